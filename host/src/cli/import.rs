//! `sinew import`: a network of another tool.

use std::path::PathBuf;

use clap::Args;
use sinew_codegen::network::commands;

use crate::error::{Error, Result};

/// Arguments of `sinew import`.
#[derive(Args)]
pub struct Arguments {
    /// The network: .onnx, .keras, .h5, .tflite, or a folder with network.toml or model.toml.
    network: PathBuf,
    /// Folder to write it to, as network.toml and weights.safetensors.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// # Errors
/// A file that is no network, or one with a layer that cannot be emitted.
pub fn run(arguments: &Arguments) -> Result<()> {
    let text = commands::import(&arguments.network, arguments.out.as_deref());
    print!("{}", text.map_err(Error::arguments)?);
    Ok(())
}
