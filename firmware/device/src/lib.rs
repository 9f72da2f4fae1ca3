#![no_std]
#![forbid(unsafe_code)]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "`!(a > b)` is how a NaN takes the refusing branch"
)]
//! A controller of `sinew_mpc` as a device: frames in, frames out, and the decision whether
//! anything may move.
//!
//! [`session`] is a pure state machine around the control loop: a board moves bytes, reads sensors
//! and sets outputs. No heap, no double precision, no panic, no loop without a bound. Frames:
//! `docs/reference/protocol.md`; faults: `docs/reference/faults.md`.

pub mod bumpless;
#[cfg(feature = "checks")]
pub mod checks;
pub mod clock;
pub mod converter;
pub mod mode;
pub mod protocol;
pub mod session;
pub mod supervisor;
