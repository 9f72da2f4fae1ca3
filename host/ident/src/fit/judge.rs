//! Result of a search: what it leaves undetermined is held, bounds that it reached are looked
//! beyond, and the errors are those of whole runs.

use std::time::Instant;

use sinew_sim::{Parameter, Plant, Rig};

use super::beyond;
use super::bounds;
use super::experiment::Experiment;
use super::score::{FreeRun, OwnValue, pool, relative};
use super::stages::{Apart, Found, Local};
use super::uncertainty::{Width, interval};
use super::undetermined;
use super::{BeyondBounds, Covariance, Fit, FittedParameter, HeldInput, SensorFit};
use crate::error::Result;
use crate::noise::noise_level;

/// Judgement of rigs by what was measured.
pub(super) struct Judge<'a> {
    /// Run of a rig over each recording.
    pub runs: &'a dyn Fn(&Rig) -> Result<Vec<FreeRun>>,
    /// The same with these values of the parameters.
    pub runs_at: &'a dyn Fn(&[f64]) -> Result<Vec<FreeRun>>,
    /// Noise beside the spread of recordings that show nothing else.
    pub at_rest: Option<f64>,
    /// White noise of a sensor, root mean square over runs, SI.
    pub noise: &'a dyn Fn(&[FreeRun], usize) -> f64,
    /// Beginning of the fit.
    pub begun: Instant,
}

impl Judge<'_> {
    /// Holds what the recordings do not determine, looks beyond bounds that are reached, and gives
    /// the result. `run` fits with some parameters apart.
    pub fn conclude(
        &self,
        (rig, plant, experiments): (&Rig, &Plant, &[Experiment]),
        (as_written_runs, first): (Vec<FreeRun>, Found),
        run: &mut dyn FnMut(Apart) -> Result<Found>,
    ) -> Result<Fit> {
        let mut holding = |held: &[usize]| {
            run(Apart {
                held,
                ..Apart::default()
            })
        };
        let error = |rig: &Rig| Ok(relative(&pool(&(self.runs)(rig)?)));
        let first = (first, self.at_rest);
        let (found, fitted) = undetermined::keep((rig, plant), &error, first, &mut holding)?;
        let runs = (self.runs)(&fitted)?;
        let errors = pool(&runs);
        let mut releasing = |released: &[usize]| {
            let held = &found.held;
            run(Apart {
                held,
                released,
                ..Apart::default()
            })
        };
        let within = (&found, &errors[..]);
        let errors_at = |values: &[f64]| Ok(pool(&(self.runs_at)(values)?));
        let beyond = beyond::beyond(plant, &errors_at, within, &mut releasing)?;
        Ok(self.result(
            (plant, experiments),
            as_written_runs,
            (found, fitted),
            (runs, beyond),
        ))
    }

    /// Result of the search as it ended.
    pub fn searched(
        &self,
        (rig, plant, experiments): (&Rig, &Plant, &[Experiment]),
        (as_written_runs, found): (Vec<FreeRun>, Found),
    ) -> Result<Fit> {
        let fitted = undetermined::fitted(rig, plant, &found)?;
        let runs = (self.runs)(&fitted)?;
        Ok(self.result(
            (plant, experiments),
            as_written_runs,
            (found, fitted),
            (runs, None),
        ))
    }

    /// Parameters and errors of what was found.
    fn result(
        &self,
        (plant, experiments): (&Plant, &[Experiment]),
        as_written_runs: Vec<FreeRun>,
        (found, fitted): (Found, Rig),
        (runs, beyond): (Vec<FreeRun>, Option<BeyondBounds>),
    ) -> Fit {
        let known = plant.parameters();
        let shared = found.slots.iter().enumerate().map(|(j, &slot)| {
            let own = (found.widths[j].half(), Vec::new());
            fitted_parameter(
                &known[slot],
                found.values[slot],
                !found.held.contains(&slot),
                own,
            )
        });
        let local = found.local.iter().map(|it| {
            let own = own_values(&known[it.slot], it, experiments);
            fitted_parameter(&known[it.slot], found.values[it.slot], true, own)
        });
        let order = |parameter: &FittedParameter| plant.slot(&parameter.name);
        let mut parameters: Vec<FittedParameter> = shared.chain(local).collect();
        parameters.sort_by_key(order);
        let sensors = pool(&as_written_runs)
            .into_iter()
            .zip(pool(&runs))
            .enumerate()
            .map(|(sensor, (before, after))| SensorFit {
                signal: after.signal,
                unit: after.unit,
                as_written_rms: before.rms,
                rms: after.rms,
                spread: after.spread,
                noise: (self.noise)(&runs, sensor),
                samples: after.samples,
            });
        let held = experiments.iter().flat_map(|experiment| {
            experiment.held.iter().map(|(column, missing)| HeldInput {
                recording: experiment.name.clone(),
                column: column.clone(),
                missing: *missing,
            })
        });
        let sensors = sensors.collect();
        Fit {
            covariance: covariance(&found, known),
            parameters,
            sensors,
            as_written_runs,
            runs,
            held: held.collect(),
            rig: fitted,
            beyond,
            runaway: found.runaway,
            stop: found.stop,
            steps: found.steps,
            seconds: self.begun.elapsed().as_secs_f64(),
        }
    }
}

/// Covariance of the parameters that have an interval.
fn covariance(found: &Found, known: &[Parameter]) -> Covariance {
    let certain = found.widths.iter().enumerate();
    let certain = certain.filter(|(_, width)| width.half().is_some());
    let places: Vec<usize> = certain.map(|(j, _)| j).collect();
    let row = |&row: &usize| {
        let columns = places.iter();
        columns
            .map(|&column| found.covariance[(row, column)])
            .collect()
    };
    let name = |&j: &usize| known[found.slots[j]].name.clone();
    Covariance {
        names: places.iter().map(name).collect(),
        rows: places.iter().map(row).collect(),
    }
}

/// White noise of each sensor, root mean square over free runs, SI.
pub(super) fn white_noise(runs: &[FreeRun], sensor: usize) -> f64 {
    let levels = runs
        .iter()
        .map(|run| noise_level(&run.t, &run.sensors[sensor].measured));
    let squares: f64 = levels.map(|level| level * level).sum();
    (squares / runs.len().max(1) as f64).sqrt()
}

/// A fitted parameter with half the width of its interval and the recordings' own values.
fn fitted_parameter(
    parameter: &Parameter,
    value: f64,
    moved: bool,
    (half, recordings): (Option<f64>, Vec<OwnValue>),
) -> FittedParameter {
    let [low, high] = bounds::bounds(parameter);
    FittedParameter {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        as_written: parameter.value,
        value,
        ci95: half.map(|half| interval(value, half)),
        at_bound: moved && (value <= low || value >= high),
        recordings,
    }
}

/// Own values of the recordings, and half the width of the interval of the mean of those that are
/// determined: `None` where none is.
fn own_values(
    parameter: &Parameter,
    local: &Local,
    experiments: &[Experiment],
) -> (Option<f64>, Vec<OwnValue>) {
    let own = local.own.iter().zip(experiments);
    let own = own.map(|(&found, experiment)| OwnValue::new(parameter, &experiment.name, found));
    let own: Vec<OwnValue> = own.collect();
    // A value at a bound does not move.
    let halves = local.own.iter().filter_map(|(_, width)| match width {
        Width::Half(half) => Some(*half),
        Width::AtBound => Some(0.0),
        Width::Open => None,
    });
    let (count, squares) = halves.fold((0, 0.0), |(count, squares), half| {
        (count + 1, squares + half * half)
    });
    let half = squares.sqrt() / f64::from(count.max(1));
    (Some(half).filter(|half| *half > 0.0), own)
}
