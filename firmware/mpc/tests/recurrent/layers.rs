//! The kernels of a printed network with a GRU or an LSTM, as they stand.
#![allow(
    dead_code,
    reason = "a printed crate copies only what its network needs"
)]

#[path = "../../../../codegen/nn/kernels/layers/along.rs"]
pub mod along;
#[path = "../../../../codegen/nn/kernels/layers/dense.rs"]
pub mod dense;
#[path = "../../../../codegen/nn/kernels/layers/elementwise.rs"]
pub mod elementwise;
#[path = "../../../../codegen/nn/kernels/layers/gate.rs"]
pub mod gate;
#[path = "../../../../codegen/nn/kernels/layers/gru.rs"]
pub mod gru;
#[path = "../../../../codegen/nn/kernels/layers/lstm.rs"]
pub mod lstm;
#[path = "../../../../codegen/nn/kernels/layers/rows.rs"]
pub mod rows;
#[path = "../../../../codegen/nn/kernels/layers/activation/sigmoid.rs"]
pub mod sigmoid;
#[path = "../../../../codegen/nn/kernels/layers/activation/tanh.rs"]
pub mod tanh;
