//! Settings of the predictive controller by the derivatives of its closed loop: the plant by dual
//! numbers, the optimiser by its conditions of optimality (docs/explanation/controller.md,
//! section 12).

mod closed_loop;
mod controller;
pub mod levenberg;
mod network;
mod newton;
mod plan;
mod search;
mod subproblem;
#[cfg(test)]
mod tests;

pub use search::{Found, Search};
