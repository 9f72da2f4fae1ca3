//! Small networks trained on a simulated plant, for a predictive controller.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`dataset`] | a fitted plant | short simulated motions and their derivatives |
//! | [`train`] | those motions | a network's weights |

pub mod dataset;
pub mod train;
