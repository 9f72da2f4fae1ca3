#![no_std]
#![forbid(unsafe_code)]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "`!(a > b)` is how a NaN takes the refusing branch"
)]
//! The controller as pure functions of fixed-size state: no heap, no double precision, no panic, no
//! loop without a bound. The same source runs on the host and on a Cortex-M4F, to the same bits.
//!
//! A step measures, estimates, optimises and limits ([`control_loop`]). Generated code implements
//! [`model::Model`] from the kernels of [`network`] and fills the const parameters. Equations:
//! `docs/explanation/controller.md`.

pub mod control_loop;
pub mod estimator;
pub mod feedback;
pub mod linear_path;
pub mod math;
pub mod memory;
pub mod model;
pub mod mpc;
pub mod network;
pub mod pid;
pub mod rise;
pub mod safety;
pub mod scaling;
pub mod status;
