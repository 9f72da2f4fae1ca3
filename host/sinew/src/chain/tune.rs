//! Weights of the predictive controller, found on the fitted plant and plants near it: never on the
//! plant, the reference or the noise that the comparison uses.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use sinew_codegen::fingerprint;
use sinew_codegen::spec::ModelSpec;

use crate::compare::closed_loop::Scenario;
use crate::compare::mpc::{MpcController, Weights};
use crate::compare::objective::Objective;
use crate::compare::optimise::{Range, minimise};
use crate::device::Device;
use sinew_ident::error::{Error, Result};

use crate::progress::Stage;
use crate::project::{self, Board, Optimise};

use super::build::compile_in;
use super::side_by_side::Bench;
use super::task::Task;

/// Builds the controller of `spec` in `folder` for this computer, tunes it on the bench's plant and plants near it, and
/// leaves the weights in `spec`.
///
/// # Errors
/// The firmware does not build, or as [`tune`].
pub fn tuned(
    spec: &mut ModelSpec,
    bench: &Bench<'_>,
    folder: &Path,
    cache: Option<&Path>,
    quiet: bool,
) -> Result<()> {
    // This computer's program is the same either way.
    project::write(folder, spec, Optimise::Speed)?;
    let host = compile_in(folder, Board::Host, cache, quiet)?;
    let stage = Stage::begin("tune the controller", quiet);
    let scenarios = bench.tuning_scenarios(&bench.tuning_plants())?;
    let device = || Bench::start(folder, Board::Host, &host);
    let weights = tune(device, fingerprint(spec), &scenarios, bench.task)?;
    spec.control.move_suppression = weights.move_suppression;
    spec.control.disturbance_gain = weights.disturbance_gain;
    stage.end(format!(
        "move suppression {:.1e}, disturbance gain {:.2}",
        spec.control.move_suppression[0], spec.control.disturbance_gain
    ));
    Ok(())
}

/// Tunes move suppression (one factor for all inputs) and the gain of the disturbance estimate on
/// `scenarios`; a move suppression that the rig fixes is kept.
///
/// `start` gives a device that has run nothing yet: a reset would keep the command applied last.
///
/// # Errors
/// The device does not answer, or no weights give a finite cost.
pub fn tune(
    start: impl Fn() -> Result<Device> + Sync,
    model: u32,
    scenarios: &[Scenario],
    task: &Task,
) -> Result<Weights> {
    let weights = |g: &[f64]| Weights {
        tracking_weight: task.tracking_weight.clone(),
        move_suppression: task
            .move_suppression
            .clone()
            .unwrap_or_else(|| vec![g[0]; task.limits.len()]),
        disturbance_gain: g[1],
        iterations: 2,
    };
    let failure = Mutex::new(None);
    let judge = |g: &[f64]| -> f64 {
        let mut total = 0.0;
        for scenario in scenarios {
            let run = start().and_then(|mut device| {
                let mut mpc = MpcController::new(&mut device, model)?;
                mpc.tune(&weights(g))?;
                scenario.run(&mut mpc)
            });
            match run {
                Ok(run) => {
                    total += Objective::Tracking.cost(
                        &run.score(&task.limits),
                        &task.output_range,
                        &task.input_range,
                    )
                }
                Err(error) => {
                    // A panic elsewhere cannot leave an error half stored.
                    *failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                    return f64::INFINITY;
                }
            }
        }
        total
    };
    let ranges = [Range::logarithmic(1e-8, 1e2), Range::logarithmic(1e-3, 1.0)];
    let starts = [vec![1e-3, 0.02], vec![1e-2, 0.1], vec![1e-5, 0.3]];
    let (best, found) = minimise(&ranges, &starts, 30, judge);
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        _ if found.is_finite() && found < f64::MAX => Ok(weights(&best)),
        Some(error) => Err(error),
        None => Err(Error::failed("no weights give a loop that stays finite")),
    }
}
