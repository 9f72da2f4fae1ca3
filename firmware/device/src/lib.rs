#![no_std]
#![forbid(unsafe_code)]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "`!(a > b)` is how a NaN takes the refusing branch"
)]
//! A controller of `sinew_mpc` as a device: frames in, frames out, and the decision whether
//! anything may move.
//!
//! ```text
//!            bytes        frames        messages                      commands
//!   host <---------> link <----> protocol <----> session ---> mode, ramp, limits ---> actuators
//!                                                  |  ^
//!                             samples, model units v  | status
//!                                     control loop (sinew_mpc) ---> supervisor: disarm or trip
//! ```
//!
//! For whoever writes the firmware of a board, or a program that talks to one. A board owns pins,
//! clock and link; this crate owns everything between a byte and a command. Both ends of the link
//! use the same [`protocol`]:
//!
//! ```
//! use sinew_device::protocol::{Accumulator, Fed, MAX_FRAME, ToDevice, decode, encode};
//!
//! // The host asks who is there.
//! let mut buffer = [0; MAX_FRAME];
//! let frame = encode(&ToDevice::Hello, &mut buffer).expect("a greeting fits in a frame");
//!
//! // The device collects bytes until a frame is whole.
//! let mut accumulator: Accumulator = Accumulator::new();
//! let mut received = None;
//! for &byte in frame {
//!     if let Fed::Frame(bytes) = accumulator.feed(byte) {
//!         received = Some(decode::<ToDevice>(bytes));
//!     }
//! }
//! assert_eq!(received, Some(Ok(ToDevice::Hello)));
//! ```
//!
//! [`session::Session`] has an example that arms a controller and asks it for a command.
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
