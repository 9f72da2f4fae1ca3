//! From a recording and a rig to a controlled Cortex-M4F: the library behind the `sinew` program.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`sinew_ident`] | a rig and recordings | fitted parameters, named physics |
//! | [`sinew_train`] | the fitted rig | a small network |
//! | [`project`] | the network | firmware sources and images |
//! | [`device`], [`closed_loop`] | an image, a plant | a closed loop, beside a PID |
//! | [`tuning`] | a closed loop | weights and gains |
//! | [`pipeline`] | a recording | all of it, and a [`report`] |
//! | [`flash`] | an image | a board that runs it |
//! | [`explain`] | a name in a result | its meaning |
//! | [`rests`] | a rig and constant inputs | where it rests |
//! | [`live`] | a board with a rig | a recording, a watched run |
//! | [`commission`] | a rig that was never powered | signs, scales, soft limits, a recording |
//! | [`adopt`] | what a board learned | its rig |

pub mod adopt;
pub mod cli;
pub mod closed_loop;
pub mod commission;
pub mod device;
pub mod explain;
pub mod flash;
pub mod live;
pub mod new_rig;
pub mod pipeline;
pub mod preference;
pub mod project;
pub mod report;
pub mod rests;
pub mod rig_file;
pub mod tuning;
pub mod view;
