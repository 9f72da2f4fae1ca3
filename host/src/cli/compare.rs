//! `sinew compare`: the predictive controller beside a tuned PID, on this computer.

use std::path::PathBuf;

use clap::Args;

use super::{Common, Recordings};
use crate::chain::built::Loop;
use crate::error::Result;
use crate::progress::Stage;
use crate::project::Board;
use crate::report::quantity;

/// Arguments of `sinew compare`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// Folder of the firmware's sources and of the program that is built from them.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder of cargo's build outputs, if they are to be shared; otherwise DIR/target.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// # Errors
/// A bad file, a model that does not fit the rig, inputs and outputs that do not pair off.
pub fn run(arguments: &Arguments) -> Result<()> {
    let ready = Loop::load(
        &arguments.rig,
        &arguments.model,
        &arguments.recordings.fit,
        &arguments.recordings.test,
    )?;
    let bench = ready.bench(arguments.common.seed);
    let (values, moved) = bench.moved_plant();
    let scenario = bench.scenario(&values)?;
    let cache = arguments.build_dir.as_deref();
    let mpc = ready.run(
        &bench,
        &arguments.out,
        Board::Host,
        cache,
        arguments.common.quiet,
        &scenario,
    )?;
    let stage = Stage::begin("tune and run the PID", arguments.common.quiet);
    let pid = bench.pid(&values, &scenario)?;
    stage.end("on the plant that it is judged on");
    println!("reference: {}", ready.task.reference_source);
    for m in &moved {
        println!(
            "{:<32} {:>14} in the model, {:>14} in the plant",
            m.name,
            quantity(m.fitted, &m.unit),
            quantity(m.plant, &m.unit)
        );
    }
    println!(
        "{:<6} {:<12} {:>14} {:>14} {:>16} {:>15}",
        "", "output", "RMS error", "largest error", "command change", "outside limits"
    );
    for (name, score) in [("MPC", &mpc.score), ("PID", &pid.score)] {
        for (i, (unit, sensor)) in ready.units().zip(&ready.task.outputs).enumerate() {
            println!(
                "{name:<6} {:<12} {:>14} {:>14} {:>16.4} {:>15}",
                ready.plant.sensors()[*sensor].column,
                quantity(score.rms[i], unit),
                quantity(score.max[i], unit),
                score.effort.get(i).copied().unwrap_or(f64::NAN),
                score.outside_limits
            );
        }
    }
    Ok(())
}
