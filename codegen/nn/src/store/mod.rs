//! A network on disk: a folder with `network.toml` (what a person reads, or writes) and
//! `weights.safetensors` (the numbers). docs/reference/networks.md describes both.

mod read;
mod text;
mod write;

pub use read::{load, parse};
pub use write::{print, save};

/// Format that `network.toml` names.
pub const FORMAT: &str = "sinew-network/1";
/// The description's file name.
pub const NETWORK_FILE: &str = "network.toml";
/// The weights' file name.
pub const WEIGHTS_FILE: &str = "weights.safetensors";
