#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | holds |
//! |---|---|
//! | [`spec`] | signals, network and control problem, and the checks that make them valid |
//! | [`store`] | the model on disk: `model.toml` and `weights.safetensors` |
//! | [`evaluate`] | the predictor and its Jacobian in double precision, the reference of every test |
//! | [`value`] | the cost-to-go at the end of the horizon |
//! | [`work`] | instructions of an optimisation's parts, estimated |
//! | [`emit`] | the printed crate |
//! | [`policy`] | a policy: a network that moves commands, on disk and as crates |
//! | [`regenerate`] | committed models, printed again and compared |
//! | [`mod@reference`] | the importer of the reference problem |
//! | [`import`] | a network in any file or folder that this project reads |
//! | [`from_network`], [`to_network`] | a network as a predictor, and back |

pub mod emit;
pub mod evaluate;
mod fingerprint;
pub mod from_network;
pub mod import;
pub mod policy;
pub mod reference;
pub mod regenerate;
pub mod spec;
pub mod store;
pub mod to_network;
pub mod value;
pub mod work;

pub use fingerprint::fingerprint;
