//! `sinew compare`: the predictive controller beside a tuned PID, on this computer.

use clap::Args;

use super::LoopArguments;
use crate::error::Result;
use crate::progress::Stage;
use crate::project::Board;
use crate::report::quantity;

/// Arguments of `sinew compare`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
}

/// # Errors
/// A bad file, a model that does not fit the rig, inputs and outputs that do not pair off.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let ready = of_loop.load()?;
    let bench = ready.bench(of_loop.common.seed);
    let (values, moved) = bench.moved_plant();
    let scenario = bench.scenario(&values)?;
    let mpc = of_loop.run(&ready, &bench, Board::Host, &scenario)?;
    let stage = Stage::begin("tune and run the PID", of_loop.common.quiet);
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
