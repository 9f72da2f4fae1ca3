//! From a recording and a rig to a controlled Cortex-M4F: the library behind the `sinew` program.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`recording`] | a CSV file | columns |
//! | [`fit`] | a rig and recordings | the rig with its parameters refitted |
//! | [`diagnose`] | a rig and recordings | what physics the rig lacks |
//! | [`dataset`], [`train`] | the fitted rig | a small network |
//! | [`project`] | the network | firmware sources and images |
//! | [`device`], [`compare`] | an image, a plant | a closed loop, beside a PID |
//! | [`flash`] | an image | a board that runs it |
//! | [`live`] | a board with a rig | a recording, a watched run |
//! | [`report`] | all of it | a page |

pub mod atomic;
pub mod chain;
pub mod cli;
pub mod compare;
pub mod dataset;
pub mod device;
pub mod diagnose;
pub mod error;
pub mod excite;
pub mod fit;
pub mod flash;
pub mod live;
pub mod mjcf;
pub mod new_rig;
pub mod progress;
pub mod project;
pub mod recording;
pub mod report;
mod scales;
pub mod train;
pub mod view;
