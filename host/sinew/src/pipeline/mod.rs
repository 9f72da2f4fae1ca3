//! The pipeline from a recording to a controlled microcontroller.

pub mod build;
pub mod footprint;
pub mod imitation;
pub mod import;
pub mod kept_model;
mod kept_pid;
pub mod learn;
mod learn_state;
pub(crate) mod learned;
pub mod plants;
pub mod predictor;
pub mod soft_sensor;
pub mod summary;
