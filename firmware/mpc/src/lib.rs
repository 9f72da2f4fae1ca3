#![no_std]
#![forbid(unsafe_code)]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "`!(a > b)` is how a NaN takes the refusing branch"
)]
//! The controller as pure functions of fixed-size state: no heap, no double precision, no panic, no
//! loop without a bound. The same source runs on the host and on a Cortex-M4F, to the same bits.
//!
//! A step measures, estimates, optimises and limits ([`controller`]). Generated code implements
//! [`model::Model`] from the kernels of [`network`] and fills the const parameters. Equations:
//! `docs/explanation/controller.md`.

pub mod active_set;
pub mod barrier;
pub mod constraints;
pub mod controller;
pub mod cost;
pub mod estimator;
pub mod exact_hessian;
pub mod feedback;
pub mod ldl;
pub mod limits;
pub mod math;
pub mod model;
pub mod move_blocking;
pub mod network;
pub mod newton;
pub mod problem;
mod restart;
pub mod rollout;
pub mod scaling;
pub mod sensitivity;
pub mod status;
pub mod work_bound;

pub use constraints::{ActiveSet, Bounds};
pub use controller::{ControlLoop, Settings, Step};
pub use cost::{CostTerm, Quadratic};
pub use limits::Limits;
pub use model::{Jacobian, Model, Regressor};
pub use move_blocking::Horizons;
pub use newton::{MAX_ITERATIONS, Outcome, solve};
pub use problem::{Plan, Problem, Weights};
pub use scaling::ModelScaling;
pub use sensitivity::Propagate;
pub use status::Status;
pub use work_bound::{Parts, Work};
