#![doc = include_str!("../README.md")]

mod central_path;
mod count;
mod derivatives;
mod descend;
mod goal;
mod layout;
mod options;
mod plan;
mod problem;
mod quantity;
mod sample;
mod search;
mod step;
mod target;

pub use central_path::Level;
pub use count::{BACKWARD_COST, Count, FORWARD_COST};
pub use goal::Goal;
pub use options::Options;
pub use plan::{GoalOutcome, Plan, plan};
pub use problem::PlanProblem;
pub use search::{Found, Search, search};

#[cfg(test)]
mod tests;
