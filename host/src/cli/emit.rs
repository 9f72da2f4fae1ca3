//! `sinew emit`: the firmware of a model.

use std::path::PathBuf;

use clap::Args;
use sinew_codegen::store;

use crate::error::Result;
use crate::project;

/// Arguments of `sinew emit`.
#[derive(Args)]
pub struct Arguments {
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    /// Folder of the firmware's sources.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// # Errors
/// A bad model, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let spec = store::load(&arguments.model)?;
    project::write(&arguments.out, &spec)?;
    println!(
        "{}: the model, as Rust",
        arguments.out.join("model").display()
    );
    println!(
        "{}: `cargo build --release` makes its image",
        arguments.out.join("boards/qemu").display()
    );
    Ok(())
}
