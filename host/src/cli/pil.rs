//! `sinew pil`: processor in the loop.

use clap::Args;

use super::LoopArguments;
use crate::chain::side_by_side::same_bits;
use crate::error::{Error, Result};
use crate::project::Board;
use crate::report::quantity;

/// Arguments of `sinew pil`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Where the controller runs.
    #[arg(long, value_enum, default_value = "qemu")]
    board: Board,
}

/// # Errors
/// A bad file, a model that does not fit the rig, firmware that does not build or run.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let ready = of_loop.load()?;
    let bench = ready.bench(of_loop.common.seed);
    let (values, _) = bench.moved_plant();
    let scenario = bench.scenario(&values)?;
    let run = |board: Board| of_loop.run(&ready, &bench, board, &scenario);
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
