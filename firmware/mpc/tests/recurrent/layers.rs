//! The kernels of a printed network with a GRU or an LSTM, as they stand.
#![allow(
    dead_code,
    reason = "a printed crate copies only what its network needs"
)]

#[path = "../../../../codegen/kernels/src/layers/along.rs"]
pub mod along;
#[path = "../../../../codegen/kernels/src/layers/dense.rs"]
pub mod dense;
#[path = "../../../../codegen/kernels/src/layers/elementwise.rs"]
pub mod elementwise;
#[path = "../../../../codegen/kernels/src/layers/gate.rs"]
pub mod gate;
#[path = "../../../../codegen/kernels/src/layers/gru.rs"]
pub mod gru;
#[path = "../../../../codegen/kernels/src/layers/lstm.rs"]
pub mod lstm;
#[path = "../../../../codegen/kernels/src/layers/rows.rs"]
pub mod rows;
#[path = "../../../../codegen/kernels/src/layers/activation/sigmoid.rs"]
pub mod sigmoid;
#[path = "../../../../codegen/kernels/src/layers/activation/tanh.rs"]
pub mod tanh;
