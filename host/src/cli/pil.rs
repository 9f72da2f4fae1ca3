//! `sinew pil`: processor in the loop.

use std::path::PathBuf;

use clap::Args;

use super::{Common, Recordings};
use crate::chain::built::Loop;
use crate::chain::side_by_side::same_bits;
use crate::error::{Error, Result};
use crate::project::Board;
use crate::report::quantity;

/// Arguments of `sinew pil`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// Where the controller runs.
    #[arg(long, value_enum, default_value = "qemu")]
    board: Board,
    /// Folder of the firmware's sources and images.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder of cargo's build outputs, if they are to be shared; otherwise DIR/target.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// # Errors
/// A bad file, a model that does not fit the rig, firmware that does not build or run.
pub fn run(arguments: &Arguments) -> Result<()> {
    let ready = Loop::load(
        &arguments.rig,
        &arguments.model,
        &arguments.recordings.fit,
        &arguments.recordings.test,
    )?;
    let bench = ready.bench(arguments.common.seed);
    let (values, _) = bench.moved_plant();
    let scenario = bench.scenario(&values)?;
    let run = |board: Board| {
        ready.run(
            &bench,
            &arguments.out,
            board,
            arguments.build_dir.as_deref(),
            arguments.common.quiet,
            &scenario,
        )
    };
    let device = run(arguments.board)?;
    for (i, (unit, sensor)) in ready.units().zip(&ready.task.outputs).enumerate() {
        println!(
            "{}: {} RMS, {} at most, over {} steps",
            ready.plant.sensors()[*sensor].column,
            quantity(device.score.rms[i], unit),
            quantity(device.score.max[i], unit),
            device.summary.steps
        );
    }
    println!(
        "{} late, {} samples missed, {} frames rejected, {} B of stack",
        device.summary.deadline_misses,
        device.summary.missed_samples,
        device.summary.frames_rejected,
        device.summary.stack_high_water_bytes
    );
    if arguments.board != Board::Host {
        if !same_bits(&device.answers, &run(Board::Host)?.answers) {
            return Err(Error::failed(
                "the board and this computer give different commands",
            ));
        }
        println!("the same bits on this computer");
    }
    print!("{}", device.log);
    Ok(())
}
