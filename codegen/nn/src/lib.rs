#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | holds |
//! |---|---|
//! | [`import`] | importers of ONNX, Keras and TensorFlow Lite files |
//! | [`layer`], [`activation`] | the kinds of nodes of a [`Network`], a directed acyclic graph with shapes checked |
//! | [`store`] | a network on disk: `network.toml` and `weights.safetensors` |
//! | [`evaluate`] | outputs and Jacobian in double precision, the reference of every test |
//! | [`quantise`] | int8 weights with one scale a row |
//! | [`emit`] | the printed crate |
//! | [`footprint`] | flash, RAM, stack and instructions on a Cortex-M4F; the table of boards |
//! | [`summary`] | a network as a table of text |

pub mod activation;
mod build_error;
pub mod commands;
pub mod emit;
mod error;
pub mod evaluate;
mod fold;
pub mod footprint;
mod generated;
mod graph;
pub mod import;
pub mod layer;
pub mod limits;
pub mod literal;
pub mod math;
pub mod quantise;
pub mod rounding;
mod shape;
pub mod store;
pub mod summary;
pub mod target;
mod validate;

pub use activation::Activation;
pub use build_error::BuildError;
pub use error::{Cause, NetworkError};
pub use graph::{Golden, Network, Node};
pub use layer::{Cell, Convolution, Dense, Op, Pool, PoolKind, Recurrent, Selection, Window};
pub use validate::is_package_name;
