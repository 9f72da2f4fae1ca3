//! A typed network in, fast checked `no_std` Rust out.
//!
//! - [`spec`]: the one description of a model, and what makes it valid.
//! - [`store`]: that description on disk, `model.toml` and `weights.safetensors`.
//! - [`evaluate`]: the network and its Jacobian in double precision, the reference for everything.
//! - [`emit`]: the description as a Rust crate that depends only on `sinew-firmware`.
//! - [`regenerate`]: committed models, printed again and compared.
//! - [`mod@reference`]: the importer of the reference problem.
//!
//! Equations and file formats: docs/reference/model-files.md.

pub mod emit;
pub mod evaluate;
mod fingerprint;
mod math;
pub mod network;
pub mod reference;
pub mod regenerate;
pub mod spec;
pub mod store;

pub use fingerprint::fingerprint;
