//! `sinew size`: what a network takes on a board, before anything is flashed.

use std::path::PathBuf;

use clap::Args;
use sinew_codegen::network::commands;
use sinew_codegen::network::emit::{Options, Weights};

use crate::error::{Error, Result};

/// Arguments of `sinew size`.
#[derive(Args)]
pub struct Arguments {
    /// The network: a file or folder that `sinew import` reads, or a model of `sinew train`.
    network: PathBuf,
    /// stm32f446, nrf52840 or qemu.
    #[arg(long)]
    board: String,
    /// Tanh within 2e-7 instead of 2e-6.
    #[arg(long)]
    precise: bool,
    /// float32, or int8: a quarter of the flash for weights; the loss of accuracy is printed.
    #[arg(long, value_name = "KIND", default_value = "float32")]
    weights: Weights,
    /// Folder that keeps what is compiled, for the next time.
    #[arg(
        long,
        value_name = "DIR",
        env = "SINEW_BUILD_DIR",
        default_value = "target/size"
    )]
    build_dir: PathBuf,
}

/// # Errors
/// A network that cannot be emitted, a board that is not there, or no compiler for the target.
pub fn run(arguments: &Arguments) -> Result<()> {
    commands::board(&arguments.board).map_err(Error::arguments)?;
    let mut options = Options::with_precise(arguments.precise);
    options.weights = arguments.weights;
    let (network, folder) = (&arguments.network, &arguments.build_dir);
    let text = commands::size(network, &arguments.board, &options, folder);
    print!("{}", text.map_err(Error::failed)?);
    Ok(())
}
