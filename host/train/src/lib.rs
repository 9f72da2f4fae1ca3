//! Small networks trained on a simulated plant, for a predictive controller.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`dataset`] | a fitted plant | short simulated motions and their derivatives |
//! | [`train`] | those motions | a network's weights |
//! | [`soft_sensor`] | channels and outputs of one recording | the outputs, from the channels |
//! | [`state`] | a population of plants | a state-space model's weights |

mod channel_watch;
pub mod dataset;
mod network_table;
pub mod soft_sensor;
pub mod state;
pub mod train;

pub use network_table::{FirstLayer, Form, NetworkTable};
