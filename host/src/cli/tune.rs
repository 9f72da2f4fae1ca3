//! `sinew tune`: the weights of a predictive controller.

use std::path::PathBuf;

use clap::Args;

use super::LoopArguments;
use crate::chain::learn::save;
use crate::chain::tune::tuned;
use crate::error::Result;

/// Arguments of `sinew tune`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Folder of the model, which is written again: model.toml and weights.safetensors.
    model: PathBuf,
}

/// # Errors
/// A bad file, a model that does not fit the rig, or firmware that does not build.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let ready = of_loop.load(None)?;
    let mut spec = ready.model(&arguments.model)?;
    tuned(
        &mut spec,
        &ready.bench(),
        &of_loop.out,
        of_loop.build_dir.as_deref(),
        of_loop.common.quiet,
    )?;
    save(&arguments.model, &spec)?;
    println!(
        "move suppression {:.3e}, disturbance gain {:.3}",
        spec.control.move_suppression[0], spec.control.disturbance_gain
    );
    Ok(())
}
