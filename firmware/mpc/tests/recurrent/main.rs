//! Recurrent predictors behind the one trait: what a GRU or an LSTM remembers is a channel that the
//! model predicts and nobody measures. The cells are the kernels that `sinew emit` copies into a
//! printed network, held here against double precision written from their equations
//! (docs/reference/networks.md, eq. 5 and 6).
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

// As in a printed crate: the kernels find these two at the crate's root.
use sinew_mpc::math;
#[allow(
    dead_code,
    reason = "a printed crate copies only what its network needs"
)]
#[path = "../../../../codegen/nn/kernels/number.rs"]
mod number;

#[path = "../common/mod.rs"]
mod common;

#[path = "../../../../tests/vectors/src/cells.rs"]
mod cells;
mod closed_loop;
mod derivatives;
mod exact;
mod layers;

use common::random;
