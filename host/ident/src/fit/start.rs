//! Initial states of the shooting segments, as far as the recording shows them.

use nalgebra::{DMatrix, DVector};
use sinew_sim::{Plant, SensorChannel};

use super::experiment::{ANCHORED, Experiment, View, Views, start_rows};
use super::levenberg::{DecisionVariables, Prior, StoppingCriteria, minimise};
use super::segment::{InitialStatePrior, Problem, Segment};
use crate::error::Result;

/// Rows on either side of a start that its position and velocity are taken from.
const REACH: usize = 8;

/// Start states for segments in order of time. What a sensor shows is taken from the recording;
/// what none shows is where the segment before ended, or where the rig says that a device starts: a
/// memory that began with the recording's first sample in the middle of it would spoil what
/// follows.
///
/// # Errors
/// None that checking the recording has not excluded.
pub(crate) fn states(
    problem: &Problem,
    views: &Views,
    segments: &[Segment],
    values: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let mut states: Vec<Vec<f64>> = Vec::with_capacity(segments.len());
    let mut ended: Option<Vec<f64>> = None;
    let readings = lagging(problem.plant);
    let follows = |index: usize| {
        let pair = index
            .checked_sub(1)
            .map(|before| segments.get(before..=index));
        pair.flatten().is_some_and(|pair| {
            pair[0].experiment == pair[1].experiment && pair[0].rows.end == pair[1].rows.start
        })
    };
    for (index, segment) in segments.iter().enumerate() {
        let experiment = &problem.experiments[segment.experiment];
        let mut state = match ended.take() {
            Some(state) => state,
            None => {
                let mut state = at_rest(problem.plant, experiment, segment.rows.start, values)?;
                state.resize(state.len() + problem.local.len(), 0.0);
                state
            }
        };
        show(experiment, views, segment.rows.start, values, &mut state);
        for (view, reading) in &readings {
            let seen = experiment.value_and_slope(view.sensor, segment.rows.start, REACH);
            if let Some([value, _]) = seen {
                state[*reading] = view.reading(value, values);
            }
        }
        if follows(index + 1) && unseen(views) {
            // Rows are disjoint, so this is where the last row is: one interval short of the next
            // start.
            ended = problem.final_state(segment, values, &state);
        }
        states.push(state);
    }
    Ok(states)
}

/// The start that `sinew simulate` takes (docs/reference/rig-file.md), of a recording that begins
/// at `row`.
fn at_rest(plant: &Plant, experiment: &Experiment, row: usize, values: &[f64]) -> Result<Vec<f64>> {
    let first: Vec<Option<f64>> = experiment
        .signals
        .iter()
        .map(|column| {
            let mut later = column[row..].iter().copied();
            later.find(|value| value.is_finite())
        })
        .collect();
    Ok(plant.initial_state(values, &first)?)
}

/// Sensors that lag, each with the state that holds its reading.
fn lagging(plant: &Plant) -> Vec<(View, usize)> {
    let names = plant.state_names();
    let reading = |(sensor, described): (usize, &SensorChannel)| {
        let name = &described.name;
        let reading = format!("{name}.sensor_lag.reading");
        let state = names.iter().position(|known| *known == reading)?;
        let gain = plant.slot(&format!("{name}.gain"));
        let offset = plant.slot(&format!("{name}.offset"));
        let view = View {
            sensor,
            gain,
            offset,
        };
        Some((view, state))
    };
    plant
        .sensors()
        .iter()
        .enumerate()
        .filter_map(reading)
        .collect()
}

/// Some state has no sensor.
fn unseen(views: &Views) -> bool {
    let imposed = |body: usize| views.imposed.iter().any(|&(known, _)| known == body);
    let hidden = |(body, view): (usize, &Option<View>)| view.is_none() && !imposed(body);
    views.position.iter().enumerate().any(hidden) || views.internal > 0
}

/// Overwrites what sensors show at a row.
fn show(experiment: &Experiment, views: &Views, row: usize, values: &[f64], state: &mut [f64]) {
    let bodies = views.position.len();
    for body in 0..bodies {
        if let Some(view) = views.position[body]
            && let Some([value, slope]) = experiment.value_and_slope(view.sensor, row, REACH)
        {
            state[body] = view.reading(value, values);
            state[bodies + body] = slope / view.gain(values);
        }
        if let Some(view) = views.velocity[body]
            && let Some([value, _]) = experiment.value_and_slope(view.sensor, row, REACH)
        {
            state[bodies + body] = view.reading(value, values);
        }
    }
    for &(body, input) in &views.imposed {
        state[body] = experiment.inputs[input][row];
        state[bodies + body] = experiment.inputs[input + 1][row];
    }
}

/// Natural sizes of the states: the largest position and velocity that sensors show of a body; for
/// a body that none shows, the largest of the others, and so for internal states.
pub(crate) fn scales(experiments: &[Experiment], views: &Views, values: &[f64]) -> Vec<f64> {
    let bodies = views.position.len();
    let mut scale = vec![0.0_f64; 2 * bodies];
    for experiment in experiments {
        let stride = (experiment.rows() / 200).max(1);
        for row in (0..experiment.rows()).step_by(stride) {
            let mut state = vec![0.0; 2 * bodies];
            show(experiment, views, row, values, &mut state);
            for (largest, value) in scale.iter_mut().zip(state) {
                *largest = largest.max(value.abs());
            }
        }
    }
    for half in [0..bodies, bodies..2 * bodies] {
        let largest = scale[half.clone()].iter().copied().fold(0.0, f64::max);
        let fallback = if largest > 0.0 { largest } else { 1.0 };
        scale[half]
            .iter_mut()
            .filter(|value| **value <= 0.0)
            .for_each(|value| *value = fallback);
    }
    // Internal states are mostly extensions and readings; a first guess at their size.
    let internal = scale[..bodies].iter().copied().fold(0.0, f64::max);
    scale.resize(2 * bodies + views.internal, internal);
    scale
}

/// The start states that explain segments best while the parameters stay. Where one cannot be
/// simulated, the states stay too: the run itself then shows what is wrong.
pub(crate) fn settle(
    problem: &Problem,
    segments: &[Segment],
    values: &[f64],
    states: Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    let states = near(problem, segments, values, states);
    best(problem, segments, values, states)
}

/// First rows of a segment that say where it starts, and how many times as long it is at least.
const FIRST_ROWS: usize = 30;
const LONGER: usize = 3;

/// Start states that explain the first rows of long segments, where the segment gains by it: over
/// many rows a start that is a little off ends in another well of a ripple, or at rest where the
/// device slid on.
pub(crate) fn near(
    problem: &Problem,
    segments: &[Segment],
    values: &[f64],
    mut states: Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    for (segment, state) in segments.iter().zip(&mut states) {
        if segment.rows.len() < LONGER * FIRST_ROWS {
            continue;
        }
        let rows = segment.rows.start..segment.rows.start + FIRST_ROWS;
        let first = problem.segment(segment.experiment, rows);
        let Ok(mut first) = first else { continue };
        first.anchor = segment.anchor.clone();
        let found = best(problem, &[first], values, vec![state.clone()]).swap_remove(0);
        let whole = std::slice::from_ref(segment);
        let cost = |state: &Vec<f64>| problem.cost(whole, values, std::slice::from_ref(state));
        if cost(&found) < cost(state) {
            *state = found;
        }
    }
    states
}

/// One search for start states.
fn best(
    problem: &Problem,
    segments: &[Segment],
    values: &[f64],
    states: Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    let held = problem.states_only();
    let belief = Prior::none();
    let mut unknowns = DecisionVariables {
        values: values.to_vec(),
        states,
    };
    let effort = StoppingCriteria {
        iterations: 40,
        relative: 1e-9,
    };
    let _ = minimise(
        &held,
        &belief,
        segments,
        &mut unknowns,
        &effort,
        &mut |_, _| {},
    );
    unknowns.states
}

/// Estimates the initial state from the first 5 % of a recording, with the parameters as they are,
/// and how firmly (docs/explanation/identification.md, eq. 10).
///
/// # Errors
/// None that checking the recording has not excluded.
pub(crate) fn estimate(
    problem: &Problem,
    experiment: usize,
    values: &[f64],
    guess: Vec<f64>,
) -> Result<(Vec<f64>, InitialStatePrior)> {
    let rows = problem.experiments[experiment].rows();
    let held = problem.states_only();
    let window = [problem.segment(experiment, 0..start_rows(rows).min(rows))?];
    let state = settle(&held, &window, values, vec![guess]).swap_remove(0);
    let Some(shown) = held.rows(&window[0], values, &state) else {
        let loose = InitialStatePrior::loose(state.len());
        return Ok((state, loose));
    };
    let normal = held.normal(&window[0], &shown, &state);
    // Variance of what these rows are missed by, in units of the weights of the whole.
    let count = normal.counts.iter().sum::<usize>().max(1) as f64;
    let variance = (normal.squares.iter().sum::<f64>() / count).max(1e-12);
    let mean = scaled(&state, &problem.state_scale);
    Ok((
        state,
        of_plant(
            mean,
            normal.xx / (variance / firmness(variance)),
            problem.plant.state_len(),
        ),
    ))
}

/// Factor by which the variance of twenty rows may be too small by chance: chi-squared with 18
/// degrees of freedom, at 95 %.
const AT_LEAST: f64 = 2.0;

/// Part of what the first rows say of a start by which it is anchored.
///
/// They are among all rows already. Where they are missed as all rows are, `variance` of 1, the
/// anchor would say twice what they show of a start, with the parameters of the moment: it would
/// hold those where they are that only the start shows. A motor behind a shaft is one.
fn firmness(variance: f64) -> f64 {
    (1.0 - AT_LEAST * variance * (1.0 - ANCHORED)).max(ANCHORED)
}

/// Prior of the plant's own states alone: those after them, which the whole recording shows, are
/// left loose, and what is known of the others only together with them is given up.
fn of_plant(mut mean: DVector<f64>, weight: DMatrix<f64>, own: usize) -> InitialStatePrior {
    let others = mean.len() - own;
    if others == 0 {
        return InitialStatePrior { mean, weight };
    }
    let mut prior = InitialStatePrior::loose(mean.len());
    let across = weight.view((0, own), (own, others)).into_owned();
    let inner = weight.view((own, own), (others, others)).into_owned();
    let known = weight.view((0, 0), (own, own)).into_owned();
    if let Some(factor) = inner.cholesky() {
        let marginal = known - &across * factor.solve(&across.transpose());
        prior
            .weight
            .view_mut((0, 0), (own, own))
            .copy_from(&marginal);
        mean.rows_mut(own, others).fill(0.0);
        prior.mean = mean;
    }
    prior
}

fn scaled(state: &[f64], scale: &[f64]) -> DVector<f64> {
    DVector::from_iterator(
        state.len(),
        state.iter().zip(scale).map(|(x, scale)| x / scale),
    )
}

/// Anchors the start of each whole recording to what its first rows say, as firmly as they say it.
///
/// A rig that lacks something misses a whole recording by far more than its first rows. Left free,
/// the start state would give up what those rows show to make the rest look better; the anchor
/// keeps it where it was measured. Where noise is all there is, it adds a twentieth to what the
/// first rows say anyway. Returns how far the anchors moved, in units of the states' scales.
///
/// # Errors
/// None that checking the recording has not excluded.
pub(crate) fn anchor(
    problem: &Problem,
    segments: &mut [Segment],
    values: &[f64],
    states: &[Vec<f64>],
) -> Result<f64> {
    let mut moved: f64 = 0.0;
    for (segment, state) in segments.iter_mut().zip(states) {
        let (_, anchor) = estimate(problem, segment.experiment, values, state.clone())?;
        moved = moved.max((&anchor.mean - &segment.anchor.mean).amax());
        segment.anchor = anchor;
    }
    Ok(moved)
}
