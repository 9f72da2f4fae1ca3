//! A trained network in, a `no_std` Rust crate with exact derivatives out.
//!
//! - [`import`]: ONNX, Keras and TensorFlow Lite files as a [`Network`].
//! - [`Network`]: layers as a directed graph without cycles, with shapes checked.
//! - [`store`]: a network on disk, `network.toml` and `weights.safetensors`.
//! - [`evaluate`]: the network and its Jacobian in double precision, the reference for everything.
//! - [`emit`]: the network as a Rust crate that depends on nothing.
//! - [`footprint`]: flash, RAM, stack and instructions of that crate on a Cortex-M4F.
//!
//! Equations and file formats: docs/reference/networks.md.

pub mod activation;
mod build_error;
pub mod commands;
pub mod emit;
mod error;
pub mod evaluate;
pub mod files;
mod fold;
pub mod footprint;
mod graph;
pub mod import;
pub mod layer;
pub mod limits;
pub mod literal;
pub mod math;
pub mod quantise;
mod shape;
pub mod store;
pub mod summary;
pub mod target;
mod validate;

pub use activation::Activation;
pub use build_error::BuildError;
pub use error::NetworkError;
pub use graph::{Golden, Network, Node};
pub use layer::{Cell, Convolution, Dense, Op, Pool, PoolKind, Recurrent, Window};
pub use validate::is_package_name;
