//! A board's own rig, from this computer: playing an excitation, watching and steering a run.

pub mod monitor;
mod names;
pub mod record;
mod units;

pub use names::Names;
pub use units::Units;
