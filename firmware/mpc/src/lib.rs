#![no_std]
#![forbid(unsafe_code)]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "`!(a > b)` is how a NaN takes the refusing branch"
)]
//! Nonlinear model predictive control with a fixed bound on its work, in `no_std` Rust without a
//! heap.
//!
//! # Optimal control problem
//!
//! At every step k the controller minimises, over the commands u(k) .. u(k+Nc-1) held after that,
//!
//! ```text
//! J = sum_{j=N1..N} e_j' Q e_j + sum_{i=0..Nc-1} du_i' Lambda du_i      e_j = y(k+j) - r(k+j)
//!
//! subject to  y(k+j+1) = f(u(k+j) .., y(k+j) .., s(k)) + d              du_i = u(k+i) - u(k+i-1)
//!             lower <= u(k+i) <= upper,   |du_i| <= rate
//! ```
//!
//! and applies the first command. The model f is any implementation of [`Model`]: a trained network
//! or a page of physics. The disturbance d removes the steady error ([`estimator`]). J is minimised
//! by Newton's method with exact derivatives ([`newton`]); each quadratic subproblem is solved by a
//! primal active-set method ([`active_set`]), whose every iterate is feasible. The limits hold
//! exactly, whatever comes in ([`limits`]). The number of operations has a bound that is known when
//! the program is compiled ([`work_bound`]).
//!
//! No heap, no double precision, no panic, no loop without a bound, no dependency. The same source
//! gives the same bits on a computer and on a Cortex-M4F.
//!
//! # Use
//!
//! Implement [`Model`] (a prediction and its derivatives), name the shapes by [`controller!`], and
//! call [`ControlLoop::step`] once a period. The example of [`controller!`] is complete;
//! `examples/` has a heater and a pendulum. A model with a state has [`StateLoop`] instead, behind
//! the Kalman filter of [`filter`]; [`state_controller!`] names its shapes. [`feedback`] has PID
//! and RISE behind the same limits. Generated models use the kernels of [`network`].
//!
//! Equations: `docs/explanation/controller.md` of the project.

pub mod active_set;
pub mod band;
pub mod barrier;
pub mod budget;
pub mod channel_watch;
mod chunk;
pub mod constraints;
pub mod controller;
mod controller_macro;
pub mod cost;
pub mod differentiate;
pub mod estimator;
pub mod exact_hessian;
pub mod feedback;
pub mod filter;
pub mod ldl;
pub mod limits;
pub mod math;
pub mod model;
pub mod move_blocking;
pub mod network;
pub mod newton;
pub mod predictive_loop;
pub mod problem;
mod restart;
pub mod rollout;
pub mod scaling;
pub mod sensitivity;
pub mod settings;
pub mod soft_sensor;
pub mod state_loop;
pub mod state_predictor;
pub mod status;
pub mod terminal;
pub mod tuning;
pub mod work_bound;

pub use budget::{Budget, Interrupt, Meter, Unlimited, Until};
pub use channel_watch::{ChannelWatch, Consistency};
pub use constraints::{ActiveSet, Bounds};
pub use controller::{ControlLoop, Settings, Step};
pub use cost::{CostTerm, Quadratic};
pub use differentiate::{PlanDerivatives, differentiate};
pub use filter::{Filter, FilterSettings, LateFilter, Prior, StateSpace};
pub use limits::Limits;
pub use model::{Jacobian, Model, Regressor};
pub use move_blocking::Horizons;
pub use newton::{MAX_ITERATIONS, Outcome, solve, solve_until, solve_within};
pub use predictive_loop::PredictiveLoop;
pub use problem::{Plan, Problem, Weights};
pub use scaling::ModelScaling;
pub use sensitivity::Propagate;
pub use soft_sensor::{SensedLoop, SoftSensor};
pub use state_loop::{StateLoop, StateSettings};
pub use status::Status;
pub use terminal::{ValuePoint, Valued};
pub use tuning::Tuning;
pub use work_bound::{Parts, Work};
