//! A board's own rig, from this computer: playing an excitation, watching and steering a run.

mod learned;
mod mcap;
pub mod monitor;
mod names;
pub mod orders;
pub mod record;
mod saved;
pub mod screen;
pub mod serve;
#[cfg(test)]
mod tests;
pub mod topics;
mod units;

pub use names::Names;
pub use units::Units;
