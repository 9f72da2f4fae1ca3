//! `sinew pil`: processor in the loop.

use std::path::PathBuf;

use clap::Args;

use super::LoopArguments;
use crate::closed_loop::setup::{DeviceRun, same_bits};
use crate::device::Device;
use crate::project::Board;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::quantity;

/// Arguments of `sinew pil`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    /// The rig file of the plant in the loop, taken as written.
    ///
    /// Without it, RIG with every free parameter moved.
    #[arg(long, value_name = "RIG")]
    plant: Option<PathBuf>,
    /// Board of the controller.
    #[arg(long, value_enum, default_value = "qemu")]
    board: Board,
    /// Serial port of a board that is flashed already and paces itself.
    ///
    /// Or the socket of one in QEMU.
    #[arg(long, value_name = "PORT", conflicts_with = "board")]
    port: Option<PathBuf>,
}

/// # Errors
/// A bad file, a model that does not fit the rig, firmware that does not build or run.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let ready = of_loop.load(arguments.plant.as_deref())?;
    let spec = ready.model(&arguments.model)?;
    let bench = ready.bench();
    let scenario = [bench.scenario(&ready.values)?];
    let run = |board: Board| -> Result<DeviceRun> {
        let runs = of_loop.run(&ready, &spec, &of_loop.out, board, &scenario)?;
        let run = runs.runs.into_iter().next();
        run.ok_or_else(|| Error::failed("no loop was run"))
    };
    let device = match &arguments.port {
        None => run(arguments.board)?,
        Some(port) => {
            let model = sinew_model::fingerprint(&spec);
            bench.loop_with(Device::port(port)?, model, &scenario[0])?.0
        }
    };
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
    if arguments.port.is_some() {
        // In real time some samples come too late, and what stands in for them is no other run's.
        println!("{} ticks without a sample in time", device.late);
    } else if arguments.board != Board::Host {
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
