//! Simulations of a plant: whole recordings, sample by sample, and their gradients.

mod gradient;
mod parameterized;
mod rest;
mod run;
pub(crate) mod simulated;
mod start;
mod stepping;

pub use gradient::Gradient;
pub use parameterized::ParameterizedPlant;
pub use run::{RecordingRun, Trajectory};
pub use simulated::Simulated;
