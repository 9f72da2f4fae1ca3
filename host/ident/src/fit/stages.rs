//! The order of work: short stretches first, whole recordings last
//! (docs/explanation/identification.md, eq. 9).

use sinew_sim::{Parameter, Plant, Rig};

use super::experiment::{Experiment, Views, spreads};
use super::levenberg::{DecisionVariables, Prior, Stop, StoppingCriteria, minimise, total_cost};
use super::segment::{Problem, Segment};
use super::{FitOptions, Progress, start, uncertainty};
use crate::error::{Error, Result};

/// Stretches of the first two stages are this part of a recording; the last takes it whole.
const PARTS: [usize; 3] = [64, 8, 1];

/// No stretch is shorter than this where it can be helped: a start state of its own needs rows to
/// show.
const SHORTEST: usize = 25;

/// A relative error below this is arithmetic, not noise.
const FINEST: f64 = 1e-7;

/// Result of the stages.
pub(crate) struct Found {
    /// Parameters of the fit, those that were held included.
    pub slots: Vec<usize>,
    /// Parameters that were held as written.
    pub held: Vec<usize>,
    pub values: Vec<f64>,
    pub half_widths: Vec<Option<f64>>,
    pub stop: Stop,
    pub steps: usize,
}

/// The bounds of a parameter: its owner's, and zero where the sign is fixed.
pub(crate) fn bounds(parameter: &Parameter) -> [f64; 2] {
    let least = if parameter.non_negative {
        0.0
    } else {
        f64::NEG_INFINITY
    };
    [
        parameter.min.unwrap_or(least).max(least),
        parameter.max.unwrap_or(f64::INFINITY),
    ]
}

/// Fits; `progress` hears of every step.
pub(crate) fn run(
    rig: &Rig,
    plant: &Plant,
    experiments: &[Experiment],
    options: &FitOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Found> {
    run_holding(rig, plant, experiments, (options, &[]), progress)
}

/// Fits all parameters but some, which stay as written.
pub(crate) fn run_holding(
    rig: &Rig,
    plant: &Plant,
    experiments: &[Experiment],
    (options, held): (&FitOptions, &[usize]),
    progress: &mut dyn FnMut(Progress),
) -> Result<Found> {
    let views = Views::new(rig, plant);
    let written = plant.values();
    let mut slots = fitted_slots(plant);
    slots.retain(|slot| !held.contains(slot));
    let spreads = spreads(experiments);
    let mut problem = Problem {
        plant,
        experiments,
        scale: vec![1.0; slots.len()],
        sigma: spreads.iter().map(|spread| 1e-3 * spread).collect(),
        state_scale: start::scales(experiments, &views, &written),
        slots,
    };
    let belief = Prior {
        bounds: problem
            .slots
            .iter()
            .map(|&slot| bounds(&plant.parameters()[slot]))
            .collect(),
        written: problem.slots.iter().map(|&slot| written[slot]).collect(),
        widths: vec![options.prior_width; problem.slots.len()],
        tied: Vec::new(),
    };

    let (mut segments, mut unknowns) = if options.near {
        whole_recordings(&problem, &views, &written)?
    } else {
        first_stretches(&problem, &views, &written)?
    };
    let silent = silent_scales(&problem, &segments, &unknowns);
    let longest = experiments.iter().map(Experiment::rows).max().unwrap_or(0);
    let (mut stop, mut steps) = (Stop::Converged, 0);
    let (mut stage, mut level) = (1, 0);
    loop {
        let horizon = segments
            .iter()
            .map(|segment| segment.rows.len())
            .max()
            .unwrap_or(0);
        let last = horizon == longest;
        if last && !options.near {
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
            if last {
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
        if last {
            break;
        }
        stage += 1;
        (segments, unknowns, level) =
            next_stretches(&problem, &belief, &views, (&segments, level), &unknowns)?;
    }
    rescale(&mut problem, &belief, &unknowns, &silent);
    let widths = uncertainty::half_widths(&problem, &belief, &segments, &unknowns);
    let slots = fitted_slots(plant);
    let width = |slot: &usize| {
        let fitted = problem.slots.iter().position(|fitted| fitted == slot);
        fitted.and_then(|j| widths[j])
    };
    let half_widths = slots.iter().map(width).collect();
    Ok(Found {
        slots,
        held: held.to_vec(),
        values: unknowns.values,
        half_widths,
        stop,
        steps,
    })
}

/// Free parameters but those that only say where a simulation starts: a fit has start states of its
/// own.
pub(crate) fn fitted_slots(plant: &Plant) -> Vec<usize> {
    let starts = |slot: &usize| {
        let name = &plant.parameters()[*slot].name;
        name.ends_with(".start") || name.ends_with(".start_velocity")
    };
    plant
        .free_slots()
        .into_iter()
        .filter(|slot| !starts(slot))
        .collect()
}

/// Cuts every recording into stretches of `horizon` rows; the last takes what would be too short
/// alone.
fn cut(problem: &Problem, horizon: impl Fn(usize) -> usize) -> Result<Vec<Segment>> {
    let mut segments = Vec::new();
    for (index, experiment) in problem.experiments.iter().enumerate() {
        let rows = experiment.rows();
        let horizon = horizon(rows).clamp(1, rows);
        let count = (rows / horizon).max(1);
        for k in 0..count {
            let end = if k + 1 == count {
                rows
            } else {
                (k + 1) * horizon
            };
            segments.push(Segment::new(
                problem.plant,
                problem.experiments,
                index,
                k * horizon..end,
            )?);
        }
    }
    Ok(segments)
}

/// Rows of a stretch of stage `stage` (from 0) in a recording of `rows`.
fn horizon_of(stage: usize, rows: usize) -> usize {
    if stage + 1 >= PARTS.len() {
        return rows;
    }
    // Multiples of one another, so that what a stage found for its starts serves the next.
    let shortest = (rows / PARTS[0]).max(SHORTEST);
    shortest * (PARTS[0] / PARTS[stage])
}

/// The shortest stretches, shortened further until the rig as written can be simulated over them.
fn first_stretches(
    problem: &Problem,
    views: &Views,
    written: &[f64],
) -> Result<(Vec<Segment>, DecisionVariables)> {
    let mut divisor = 1;
    loop {
        let segments = cut(problem, |rows| horizon_of(0, rows) / divisor)?;
        let states = start::states(problem, views, &segments, written)?;
        if problem.cost(&segments, written, &states).is_finite() {
            return Ok((
                segments,
                DecisionVariables {
                    values: written.to_vec(),
                    states,
                },
            ));
        }
        divisor *= 2;
        if divisor > SHORTEST {
            return Err(beyond_simulation(
                segments
                    .iter()
                    .map(|segment| segment.rows.len())
                    .max()
                    .unwrap_or(0),
            ));
        }
    }
}

/// Every recording as one stretch, its start fitted to the rig as written.
fn whole_recordings(
    problem: &Problem,
    views: &Views,
    written: &[f64],
) -> Result<(Vec<Segment>, DecisionVariables)> {
    let segments = cut(problem, |rows| rows)?;
    let states = start::states(problem, views, &segments, written)?;
    let unknowns = DecisionVariables {
        values: written.to_vec(),
        states: start::settle(problem, &segments, written, states),
    };
    if problem
        .cost(&segments, written, &unknowns.states)
        .is_finite()
    {
        return Ok((segments, unknowns));
    }
    let rows = segments.iter().map(|segment| segment.rows.len()).max();
    Err(beyond_simulation(rows.unwrap_or(0)))
}

/// Stretches of the next level with what is known of their starts. Where they cannot be simulated
/// they are halved, and the level stays: each call gives longer stretches than the one before.
fn next_stretches(
    problem: &Problem,
    belief: &Prior,
    views: &Views,
    (segments, level): (&[Segment], usize),
    unknowns: &DecisionVariables,
) -> Result<(Vec<Segment>, DecisionVariables, usize)> {
    let longest = |segments: &[Segment]| {
        segments
            .iter()
            .map(|segment| segment.rows.len())
            .max()
            .unwrap_or(0)
    };
    for halvings in 0..6 {
        let longer = cut(problem, |rows| {
            horizon_of(level + 1, rows).min(rows) >> halvings
        })?;
        if longest(&longer) <= longest(segments) {
            break;
        }
        let mut states = start::states(problem, views, &longer, &unknowns.values)?;
        for (segment, state) in longer.iter().zip(&mut states) {
            let known = segments.iter().position(|old| {
                old.experiment == segment.experiment && old.rows.start == segment.rows.start
            });
            if let Some(known) = known {
                state.clone_from(&unknowns.states[known]);
            }
        }
        let candidate = DecisionVariables {
            values: unknowns.values.clone(),
            states,
        };
        if total_cost(problem, belief, &longer, &candidate).is_finite() {
            return Ok((
                longer,
                candidate,
                if halvings == 0 { level + 1 } else { level },
            ));
        }
    }
    Err(beyond_simulation(2 * longest(segments)))
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

/// One unit of each parameter: the larger of what the rig says and what was found, so that
/// millimetres and tonnes are alike. A parameter that is zero in both takes what would show in the
/// signals.
fn rescale(problem: &mut Problem, belief: &Prior, unknowns: &DecisionVariables, silent: &[f64]) {
    for (j, &slot) in problem.slots.iter().enumerate() {
        let size = unknowns.values[slot].abs();
        let written = belief.written[j].abs();
        problem.scale[j] = if written > 0.0 {
            written.max(size)
        } else {
            silent[j].max(size)
        };
    }
}

/// For each parameter the change that moves the signals by a hundredth of themselves.
fn silent_scales(
    problem: &Problem,
    segments: &[Segment],
    unknowns: &DecisionVariables,
) -> Vec<f64> {
    let parameters = problem.parameters();
    let Some(normals) = problem.linearise(segments, &unknowns.values, &unknowns.states) else {
        return vec![1.0; parameters];
    };
    let samples = sample_count(problem, segments) as f64;
    (0..parameters)
        .map(|j| {
            let sensitivity =
                (normals.iter().map(|normal| normal.zz[(j, j)]).sum::<f64>() / samples).sqrt();
            // Residuals are in thousandths of the signals' spread here: ten of them are a
            // hundredth.
            let scale = 10.0 / sensitivity;
            if scale.is_finite() && scale > 0.0 {
                scale
            } else {
                1.0
            }
        })
        .collect()
}

fn sample_count(problem: &Problem, segments: &[Segment]) -> usize {
    let count = segments.iter().map(|segment| {
        let signals = &problem.experiments[segment.experiment].signals;
        signals
            .iter()
            .map(|column| {
                column[segment.rows.clone()]
                    .iter()
                    .filter(|y| y.is_finite())
                    .count()
            })
            .sum::<usize>()
    });
    count.sum::<usize>().max(1)
}

/// Weights each sensor by what it is missed by; true where a weight changed by more than a tenth.
fn reweight(
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

fn beyond_simulation(rows: usize) -> Error {
    Error::failed(format!(
        "the rig cannot be simulated over {rows} rows of the recordings: it leaves all bounds"
    ))
    .help(
        "check the signs and sizes of stiffness, damping and gain; `sinew simulate` shows the run",
    )
}
