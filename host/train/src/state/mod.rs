//! Training of a state-space model on the simulator's own state, over a population of parameters
//! (docs/explanation/training.md, eq. S1 to S3).
//!
//! The regression of [`crate::train`] predicts outputs from past readings. This model predicts the
//! state, with the parameters in which devices differ among its inputs, so that a Kalman filter can
//! estimate both while it runs.

mod model;
mod predictor;
mod rollouts;

pub use model::{Scale, StateModel};
pub use predictor::{StateEpoch, StateOptions, train};
pub use rollouts::{Population, StateEpisode, draw};
