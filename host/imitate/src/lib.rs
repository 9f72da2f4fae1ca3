#![doc = include_str!("../README.md")]

mod adam;
mod adjoint;
mod cloning;
mod commands;
mod demonstration;
mod limits;
mod network;
mod period;
mod policy;
mod rollout;
mod train;
mod view;

pub use cloning::clone;
pub use commands::{Inverse, inverse};
pub use demonstration::Demonstration;
pub use limits::Limits;
pub use network::Network;
pub use policy::{Memory, Policy};
pub use rollout::{Conditions, Course};
pub use train::{Options, Progress, Task, Trained, rms, train};
pub use view::View;

#[cfg(test)]
mod tests;
