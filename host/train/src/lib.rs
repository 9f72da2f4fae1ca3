//! Small networks trained on a simulated plant, for a predictive controller.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`dataset`] | a fitted plant | short simulated motions and their derivatives |
//! | [`train`] | those motions | a network's weights |
//! | [`state`] | a population of plants | a state-space model's weights |

pub mod dataset;
mod network_table;
pub mod state;
pub mod train;

pub use network_table::{FirstLayer, Form, NetworkTable};
