//! The order of work: short stretches first, whole recordings last
//! (docs/explanation/identification.md, eq. 9).

use nalgebra::DMatrix;
use sinew_sim::{Meaning, Plant, Rig};

use super::belonging::Belonging;
use super::bounds::{bounds, natural};
use super::experiment::{Experiment, Views, spreads};
use super::horizons::{
    Continuation, beyond_simulation, first_stretches, next_stretches, whole_recordings,
};
use super::levenberg::{DecisionVariables, Prior, Stop, StoppingCriteria, minimise, total_cost};
use super::runaway::Runaway;
use super::segment::{Problem, Segment};
use super::sizes::{self, rescale, sample_count, silent_scales};
use super::uncertainty::Width;
use super::{FitOptions, Progress, local, start, uncertainty};
use crate::error::Result;

/// A relative error below this is arithmetic, not noise.
const FINEST: f64 = 1e-7;

/// Result of the stages.
pub(crate) struct Found {
    /// Parameters of the fit, those that were held included.
    pub slots: Vec<usize>,
    /// Parameters that were held as written.
    pub held: Vec<usize>,
    pub values: Vec<f64>,
    /// One entry a parameter; open where it was held.
    pub widths: Vec<Width>,
    /// Covariance of the parameters, SI; zero where a parameter was held or has none.
    pub covariance: DMatrix<f64>,
    /// Error over the spread of each signal, start states fitted to all rows, root of the sum of
    /// the squares of all sensors; infinite where that cannot be simulated.
    pub error: f64,
    /// Samples of all sensors in the fit.
    pub samples: usize,
    /// One entry a local parameter.
    pub local: Vec<Local>,
    pub stop: Stop,
    pub steps: usize,
    /// The plant runs away by itself along the recordings.
    pub runaway: Option<Runaway>,
}

/// Own values of the recordings for one parameter, SI.
pub(crate) struct Local {
    pub slot: usize,
    /// Value and its certainty, one entry a recording.
    pub own: Vec<(f64, Width)>,
}

impl Local {
    /// Mean of the values of the recordings that determine theirs, SI. The other recordings take
    /// it: they say nothing, and must not move it. `shared` where no recording determines any.
    fn share(&mut self, shared: f64) -> f64 {
        let is_known = |(_, width): &(f64, Width)| *width != Width::Open;
        let known = self.own.iter().filter(|own| is_known(own));
        let (count, sum) = known.fold((0, 0.0), |(count, sum), (value, _)| {
            (count + 1, sum + value)
        });
        if count == 0 {
            return shared;
        }
        let mean = sum / f64::from(count);
        for own in self.own.iter_mut().filter(|own| !is_known(own)) {
            own.0 = mean;
        }
        mean
    }
}

/// Parameters that a fit treats apart.
#[derive(Clone, Copy, Default)]
pub(crate) struct Apart<'a> {
    /// These stay as written.
    pub held: &'a [usize],
    /// These are free of the bounds that the rig's owner gave.
    pub released: &'a [usize],
    /// Sums of parameters with a standard normal prior: (slot, factor per SI unit) each. One with
    /// a parameter that is not fitted has none.
    pub sums: &'a [Vec<(usize, f64)>],
}

/// Fits; `progress` hears of every step.
pub(crate) fn run(
    rig: &Rig,
    plant: &Plant,
    experiments: &[Experiment],
    (options, continuation, apart): (&FitOptions, &Continuation, Apart),
    progress: &mut dyn FnMut(Progress),
) -> Result<Found> {
    let views = Views::new(rig, plant);
    let mut written = plant.values();
    let spreads = spreads(experiments);
    let mut problem = Problem {
        local: local::slots(plant),
        ..Problem::of_states(
            plant,
            experiments,
            spreads.iter().map(|spread| 1e-3 * spread).collect(),
            local::state_scales(plant, experiments, &views, &written),
        )
    };
    let belief = problem.free(options, apart);
    if let Some(fleet) = &belief.fleet {
        // A device of a fleet is sought from the fleet's middle on.
        for (&slot, mean) in problem.slots.iter().zip(fleet.means()) {
            written[slot] = mean;
        }
    }

    let (mut segments, mut unknowns) = if options.near {
        whole_recordings(&problem, &views, &written)?
    } else {
        first_stretches(&problem, &views, &written, continuation)?
    };
    let silent = silent_scales(&problem, &segments, &unknowns);
    let longest = experiments.iter().map(Experiment::rows).max().unwrap_or(0);
    let (mut stop, mut steps) = (Stop::Converged, 0);
    let (mut stage, mut level) = (1, 0);
    // An unstable plant is fitted in intervals to the end.
    let mut in_intervals = false;
    loop {
        let horizon = segments
            .iter()
            .map(|segment| segment.rows.len())
            .max()
            .unwrap_or(0);
        let whole = horizon == longest;
        let last = whole || in_intervals;
        if whole && !options.near {
            better_of_written(
                &problem,
                &belief,
                &views,
                &segments,
                &written,
                &mut unknowns,
            )?;
        }
        // Whole recordings: until the weights agree with what sensors and starts are missed by.
        for _ in 0..if last { 5 } else { 1 } {
            let mut moved = 0.0;
            problem.recentre(&segments, &mut unknowns);
            if whole {
                moved = start::anchor(&problem, &mut segments, &unknowns.values, &unknowns.states)?;
            }
            rescale(&mut problem, &belief, &unknowns, &silent);
            let effort = StoppingCriteria {
                iterations: options.iterations,
                relative: if last { 1e-5 } else { 1e-3 },
            };
            let samples = sample_count(&problem, &segments);
            let relative = problem
                .sigma
                .iter()
                .zip(&spreads)
                .map(|(sigma, spread)| sigma / spread)
                .fold(0.0, f64::max);
            let mut tell = |step, cost: f64| {
                let error = (2.0 * cost / samples as f64).sqrt() * relative;
                progress(Progress {
                    stage,
                    horizon,
                    step,
                    error,
                });
            };
            let (ended, taken) = minimise(
                &problem,
                &belief,
                &segments,
                &mut unknowns,
                &effort,
                &mut tell,
            )
            .ok_or_else(|| beyond_simulation(horizon))?;
            stop = ended;
            steps += taken;
            if !reweight(&mut problem, &segments, &unknowns, &spreads) && moved < 1e-3 {
                break;
            }
        }
        if whole {
            break;
        }
        let runaway = Runaway::along(&problem, &segments, &unknowns, &spreads);
        let most = runaway.map_or(f64::INFINITY, |runaway| runaway.longest_interval());
        let before = (&segments[..], level, most);
        let next = next_stretches(&problem, &belief, &views, before, continuation, &unknowns)?;
        match next {
            Some(next) => (segments, unknowns, level) = next,
            // Once more, to the end: parameters near the truth may be stable.
            None if last => break,
            None => {
                in_intervals = true;
                continue;
            }
        }
        in_intervals = false;
        stage += 1;
    }
    let runaway = Runaway::along(&problem, &segments, &unknowns, &spreads);
    problem.recentre(&segments, &mut unknowns);
    let ended = Ended {
        silent: &silent,
        stop,
        steps,
        runaway,
    };
    Ok(conclude(
        &mut problem,
        &belief,
        &segments,
        unknowns,
        (apart, &spreads),
        ended,
    ))
}

impl Problem<'_> {
    /// Frees the parameters that a fit may move, and returns their prior.
    pub(super) fn free(&mut self, options: &FitOptions, apart: Apart) -> Prior {
        let mut written = self.plant.values();
        self.slots = fitted_slots(self.plant);
        self.slots.retain(|slot| !apart.held.contains(slot));
        self.scale = vec![1.0; self.slots.len()];
        let bounds = self.slots.iter().map(|&slot| {
            let parameter = &self.plant.parameters()[slot];
            if apart.released.contains(&slot) {
                natural(parameter)
            } else {
                bounds(parameter)
            }
        });
        let bounds = bounds.collect();
        let names = self.slots.iter();
        let names = names.map(|&slot| self.plant.parameters()[slot].name.as_str());
        let fleet = options.fleet.as_ref();
        let fleet = fleet.and_then(|fleet| Belonging::new(fleet, &names.collect::<Vec<_>>()));
        let mut width = options.prior_width;
        if let Some(fleet) = &fleet {
            width = f64::INFINITY;
            for (&slot, mean) in self.slots.iter().zip(fleet.means()) {
                written[slot] = mean;
            }
        }
        Prior {
            bounds,
            written: self.slots.iter().map(|&slot| written[slot]).collect(),
            widths: vec![width; self.slots.len()],
            tied: Vec::new(),
            sums: (apart.sums.iter().filter_map(|sum| self.indexed(sum))).collect(),
            fleet,
        }
    }
}

impl Problem<'_> {
    /// A sum over slots as one over the fitted parameters.
    fn indexed(&self, sum: &[(usize, f64)]) -> Option<Vec<(usize, f64)>> {
        let place = |slot: usize| self.slots.iter().position(|&fitted| fitted == slot);
        sum.iter()
            .map(|&(slot, factor)| Some((place(slot)?, factor)))
            .collect()
    }
}

/// End of a search.
pub(super) struct Ended<'a> {
    pub silent: &'a [Option<f64>],
    pub stop: Stop,
    pub steps: usize,
    pub runaway: Option<Runaway>,
}

/// Values with their certainty, and the error that is left.
pub(super) fn conclude(
    problem: &mut Problem,
    belief: &Prior,
    segments: &[Segment],
    unknowns: DecisionVariables,
    (apart, spreads): (Apart, &[f64]),
    ended: Ended,
) -> Found {
    let plant = problem.plant;
    rescale(problem, belief, &unknowns, ended.silent);
    let mut widths = uncertainty::half_widths(problem, belief, segments, &unknowns);
    if belief.fleet.is_none() {
        sizes::open_by_noise(
            problem,
            belief,
            &unknowns,
            (ended.silent, &mut widths.parameters),
        );
    }
    let slots = fitted_slots(plant);
    let width = |slot: &usize| {
        let fitted = problem.slots.iter().position(|fitted| fitted == slot);
        fitted.map_or(Width::Open, |j| widths.parameters[j])
    };
    let all = slots.iter().map(width).collect();
    let place = |slot: &usize| problem.slots.iter().position(|fitted| fitted == slot);
    let places: Vec<Option<usize>> = slots.iter().map(place).collect();
    let covariance = DMatrix::from_fn(slots.len(), slots.len(), |row, column| {
        let pair = places[row].zip(places[column]);
        pair.map_or(0.0, |pair| widths.covariance[pair])
    });
    let error = error(problem, segments, &unknowns, spreads);
    let mut local = own_values(problem, segments, &unknowns, &widths.local);
    let mut values = unknowns.values;
    for it in &mut local {
        values[it.slot] = it.share(values[it.slot]);
    }
    Found {
        local,
        slots,
        held: apart.held.to_vec(),
        runaway: ended.runaway,
        values,
        widths: all,
        covariance,
        error,
        samples: sample_count(problem, segments),
        stop: ended.stop,
        steps: ended.steps,
    }
}

/// Free parameters but those that only say where a simulation starts, since a fit has start states
/// of its own, and local ones, whose values are fitted with the start states.
pub(crate) fn fitted_slots(plant: &Plant) -> Vec<usize> {
    let starts = |slot: &usize| plant.parameters()[*slot].meaning == Meaning::Start;
    plant
        .free_slots()
        .into_iter()
        .filter(|slot| !starts(slot) && !plant.parameters()[*slot].per_recording)
        .collect()
}

/// Own values of every recording; the width is that of the recording's longest segment.
fn own_values(
    problem: &Problem,
    segments: &[Segment],
    unknowns: &DecisionVariables,
    widths: &[Vec<Width>],
) -> Vec<Local> {
    let deviations = problem.deviations(segments, &unknowns.states);
    let width = |experiment: usize, index: usize| {
        let own = segments.iter().zip(widths);
        let own = own.filter(|(segment, _)| segment.experiment == experiment);
        let longest = own.max_by_key(|(segment, _)| segment.rows.len());
        let width = longest.and_then(|(_, widths)| widths.get(index).copied());
        width.unwrap_or(Width::Open)
    };
    let local = problem.local.iter().enumerate().map(|(index, &slot)| {
        let each = deviations.iter().enumerate();
        let own = each.map(|(experiment, own)| {
            let value = problem.own_value(&unknowns.values, index, own[index]);
            (value, width(experiment, index))
        });
        Local {
            slot,
            own: own.collect(),
        }
    });
    local.collect()
}

/// Whole recordings start from what the stretches found, unless the rig as written does better.
fn better_of_written(
    problem: &Problem,
    belief: &Prior,
    views: &Views,
    segments: &[Segment],
    written: &[f64],
    unknowns: &mut DecisionVariables,
) -> Result<()> {
    let states = start::states(problem, views, segments, written)?;
    let as_written = DecisionVariables {
        values: written.to_vec(),
        states,
    };
    if total_cost(problem, belief, segments, &as_written)
        < total_cost(problem, belief, segments, unknowns)
    {
        *unknowns = as_written;
    }
    Ok(())
}

/// Error of the fitted segments over the spread of the signals ([`Found::error`]).
fn error(
    problem: &Problem,
    segments: &[Segment],
    unknowns: &DecisionVariables,
    spreads: &[f64],
) -> f64 {
    let normals = problem.linearise(segments, &unknowns.values, &unknowns.states);
    let Some(normals) = normals else {
        return f64::INFINITY;
    };
    let of_sensor = |(sensor, spread): (usize, &f64)| {
        let squares: f64 = normals.iter().map(|normal| normal.squares[sensor]).sum();
        let count: usize = normals.iter().map(|normal| normal.counts[sensor]).sum();
        let sigma = problem.sigma[sensor] / spread;
        squares / count.max(1) as f64 * sigma * sigma
    };
    let sensors = spreads
        .iter()
        .enumerate()
        .filter(|(_, spread)| **spread > 0.0);
    sensors.map(of_sensor).sum::<f64>().sqrt()
}

/// Weights each sensor by what it is missed by; true where a weight changed by more than a tenth.
pub(super) fn reweight(
    problem: &mut Problem,
    segments: &[Segment],
    unknowns: &DecisionVariables,
    spreads: &[f64],
) -> bool {
    let Some(normals) = problem.linearise(segments, &unknowns.values, &unknowns.states) else {
        return false;
    };
    let mut changed = false;
    for (sensor, spread) in spreads.iter().enumerate() {
        let squares: f64 = normals.iter().map(|normal| normal.squares[sensor]).sum();
        let count: usize = normals.iter().map(|normal| normal.counts[sensor]).sum();
        if count > 0 {
            let sigma =
                (problem.sigma[sensor] * (squares / count as f64).sqrt()).max(FINEST * spread);
            changed |= (sigma / problem.sigma[sensor]).ln().abs() > 0.1;
            problem.sigma[sensor] = sigma;
        }
    }
    changed
}
