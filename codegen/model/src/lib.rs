//! The predictor of a model predictive controller: its description, its files, its emitted crate.
//!
//! - [`spec`]: signals, network and control problem, and what makes them valid.
//! - [`store`]: that description on disk, `model.toml` and `weights.safetensors`.
//! - [`evaluate`]: the predictor and its Jacobian in double precision, the reference for everything.
//! - [`emit`]: the description as a Rust crate that depends only on `sinew-mpc` and `sinew-device`.
//! - [`regenerate`]: committed models, printed again and compared.
//! - [`mod@reference`]: the importer of the reference problem.
//! - [`import`]: a network in any file or folder that this project reads.
//! - [`from_network`], [`to_network`]: a network of any kind as a predictor, and back.
//!
//! Equations and file formats: docs/reference/model-files.md.

pub mod emit;
pub mod evaluate;
mod fingerprint;
pub mod from_network;
pub mod import;
pub mod reference;
pub mod regenerate;
pub mod spec;
pub mod store;
pub mod to_network;

pub use fingerprint::fingerprint;
