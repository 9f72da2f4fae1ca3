//! A board's own rig, from this computer: playing an excitation, watching and steering a run.

pub mod monitor;
mod names;
pub mod record;

pub use names::Names;
