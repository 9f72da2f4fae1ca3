//! Local parameters: those of which each recording has a value of its own (`per = "recording"`).
//!
//! The value in a recording is the shared one plus a deviation. Over a segment the deviation is a
//! state that never changes: it is fitted and eliminated with the initial state
//! (docs/explanation/identification.md, eq. 6 and 16), whatever the number of recordings. A loose
//! prior holds it at zero where the recording says nothing.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::DVector;
use sinew_sim::{Plant, Rig};

use super::bounds::bounds;
use super::derivatives::Normal;
use super::experiment::{Experiment, Views, spreads};
use super::levenberg::{DecisionVariables, Prior};
use super::segment::{Problem, Segment};
use super::uncertainty::Width;
use super::{start, uncertainty};
use crate::error::Result;
use crate::order;

/// A written value below this part of the change that shows in the signals counts as zero.
const AS_GOOD_AS_ZERO: f64 = 1e-3;

/// Distance from a bound that is rounding, as a part of a parameter's size.
const ROUNDING: f64 = 1e-9;

/// Rows at the beginning of each recording that say what change shows in the signals.
const SCALE_ROWS: usize = 400;

/// Slots of the local parameters of a plant.
pub(crate) fn slots(plant: &Plant) -> Vec<usize> {
    let parameters = plant.parameters().iter().enumerate();
    let local = parameters.filter(|(_, parameter)| parameter.free && parameter.per_recording);
    local.map(|(slot, _)| slot).collect()
}

/// Names of the local parameters of a plant.
pub(crate) fn names(plant: &Plant) -> impl Iterator<Item = String> + '_ {
    let known = plant.parameters();
    slots(plant)
        .into_iter()
        .map(|slot| known[slot].name.clone())
}

/// Names of a segment's states: those of the plant, then the local parameters.
pub(crate) fn state_names(plant: &Plant) -> Vec<String> {
    plant
        .state_names()
        .into_iter()
        .chain(names(plant))
        .collect()
}

/// Parameter values of a segment with the deviations at the end of its state.
pub(crate) fn values<'a>(plant: &Plant, values: &'a [f64], state: &[f64]) -> Cow<'a, [f64]> {
    shifted(&slots(plant), plant, values, state)
}

/// The same for known slots.
fn shifted<'a>(slots: &[usize], plant: &Plant, values: &'a [f64], state: &[f64]) -> Cow<'a, [f64]> {
    if slots.is_empty() {
        return Cow::Borrowed(values);
    }
    let mut own = values.to_vec();
    for (&slot, deviation) in slots.iter().zip(&state[plant.state_len()..]) {
        own[slot] += deviation;
    }
    Cow::Owned(own)
}

impl Problem<'_> {
    /// A segment of one of the recordings, its initial state and deviations free.
    ///
    /// # Errors
    /// As [`Segment::new`].
    pub fn segment(&self, experiment: usize, rows: Range<usize>) -> Result<Segment> {
        let states = self.plant.state_len() + self.local.len();
        Segment::new(self.plant, self.experiments, experiment, rows, states)
    }

    /// Parameter values of the segment that has this state.
    pub fn values_at<'a>(&self, values: &'a [f64], state: &[f64]) -> Cow<'a, [f64]> {
        shifted(&self.local, self.plant, values, state)
    }

    /// The plant's own part of a segment's state.
    pub fn plant_state<'a>(&self, state: &'a [f64]) -> &'a [f64] {
        &state[..self.plant.state_len()]
    }

    /// Own value of a local parameter with this deviation, at a bound where only rounding keeps it
    /// away.
    pub fn own_value(&self, values: &[f64], index: usize, deviation: f64) -> f64 {
        let slot = self.local[index];
        let value = values[slot] + deviation;
        let near = ROUNDING * self.state_scale[self.plant.state_len() + index];
        let bounds = bounds(&self.plant.parameters()[slot]).into_iter();
        let mut resting = bounds.filter(|bound| (value - bound).abs() <= near);
        resting.next().unwrap_or(value)
    }

    /// Lower and upper end of the deviations, one entry a local parameter.
    fn room<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = [f64; 2]> + 'a {
        self.local.iter().map(|&slot| {
            let [low, high] = bounds(&self.plant.parameters()[slot]);
            [low - values[slot], high - values[slot]]
        })
    }

    /// Normal equations in which deviations that a bound holds do not move.
    pub fn held<'n>(&self, normal: &'n Normal, values: &[f64], state: &[f64]) -> Cow<'n, Normal> {
        let first = self.plant.state_len();
        let room = self.room(values).enumerate();
        let blocked = room.filter(|&(index, [low, high])| {
            let (at, slope) = (state[first + index], normal.bx[first + index]);
            at <= low && slope <= 0.0 || at >= high && slope >= 0.0
        });
        let blocked: Vec<usize> = blocked.map(|(index, _)| first + index).collect();
        if blocked.is_empty() {
            return Cow::Borrowed(normal);
        }
        let mut held = normal.clone();
        for at in blocked {
            held.bx[at] = 0.0;
            held.zx.column_mut(at).fill(0.0);
            held.xx.column_mut(at).fill(0.0);
            held.xx.row_mut(at).fill(0.0);
            held.xx[(at, at)] = 1.0;
        }
        Cow::Owned(held)
    }

    /// Cuts a segment's step, in units of the scales, where deviations would leave their bounds.
    pub fn clip_local(&self, values: &[f64], state: &[f64], step: &mut DVector<f64>) {
        let first = self.plant.state_len();
        for (index, [low, high]) in self.room(values).enumerate() {
            let (at, scale) = (state[first + index], self.state_scale[first + index]);
            step[first + index] =
                step[first + index].clamp((low - at) / scale, (high - at) / scale);
        }
    }

    /// Deviations of each recording: the median over its segments, one entry a local parameter.
    pub fn deviations(&self, segments: &[Segment], states: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let first = self.plant.state_len();
        let of = |experiment: usize, index: usize| {
            let own = segments.iter().zip(states);
            let own = own.filter(|(segment, _)| segment.experiment == experiment);
            let mut all: Vec<f64> = own.map(|(_, state)| state[first + index]).collect();
            order::sort(&mut all);
            all.get(all.len() / 2).copied().unwrap_or(0.0)
        };
        let each = |experiment| (0..self.local.len()).map(move |index| (experiment, index));
        (0..self.experiments.len())
            .map(|experiment| each(experiment).map(|(e, index)| of(e, index)).collect())
            .collect()
    }

    /// Moves each shared value to the mean of the recordings' own values, which stay.
    pub fn recentre(&mut self, segments: &[Segment], unknowns: &mut DecisionVariables) {
        let deviations = self.deviations(segments, &unknowns.states);
        let first = self.plant.state_len();
        for (index, &slot) in self.local.iter().enumerate() {
            let sum: f64 = deviations.iter().map(|own| own[index]).sum();
            let mean = sum / deviations.len().max(1) as f64;
            unknowns.values[slot] += mean;
            for state in &mut unknowns.states {
                state[first + index] -= mean;
            }
            let scale = &mut self.state_scale[first + index];
            *scale = scale.max(unknowns.values[slot].abs());
        }
    }
}

/// Natural sizes of a segment's states: those of the plant, then of the deviations.
pub(crate) fn state_scales(
    plant: &Plant,
    experiments: &[Experiment],
    views: &Views,
    values: &[f64],
) -> Vec<f64> {
    let own = start::scales(experiments, views, values);
    let deviations = scales(plant, experiments, views, values);
    [own, deviations].concat()
}

/// Natural sizes of the deviations: that of the written value, or the change that moves the signals
/// by a hundredth of themselves where it is as good as zero.
pub(crate) fn scales(
    plant: &Plant,
    experiments: &[Experiment],
    views: &Views,
    values: &[f64],
) -> Vec<f64> {
    let slots = slots(plant);
    if slots.is_empty() {
        return Vec::new();
    }
    let sigma = spreads(experiments).into_iter();
    let problem = Problem {
        scale: vec![1.0; slots.len()],
        slots: slots.clone(),
        ..Problem::of_states(
            plant,
            experiments,
            sigma.map(|spread| 1e-3 * spread).collect(),
            vec![1.0; plant.state_len()],
        )
    };
    let first = |index: usize, experiment: &Experiment| {
        problem.segment(index, 0..experiment.rows().min(SCALE_ROWS))
    };
    let segments = experiments.iter().enumerate();
    let segments: Result<Vec<Segment>> = segments.map(|(index, e)| first(index, e)).collect();
    let shown = segments.ok().and_then(|segments| {
        let states = start::states(&problem, views, &segments, values).ok()?;
        let (squares, samples) = problem.sensitivities(&segments, values, &states)?;
        let size = move |squares: f64| 10.0 / (squares / samples.max(1) as f64).sqrt();
        Some(squares.into_iter().map(size).collect::<Vec<f64>>())
    });
    let sizes = slots.iter().enumerate().map(|(index, &slot)| {
        let written = values[slot].abs();
        let shown = shown.as_ref().map(|shown| shown[index]);
        match shown.filter(|shown| shown.is_finite() && *shown > 0.0) {
            Some(shown) if written <= AS_GOOD_AS_ZERO * shown => shown,
            None if written == 0.0 => 1.0,
            _ => written,
        }
    });
    sizes.collect()
}

/// Own values of a recording from that recording alone, all else as it is, SI.
pub(super) struct Own {
    /// Every parameter, the own ones in place of the shared ones.
    pub values: Vec<f64>,
    /// Certainty of each local parameter.
    pub widths: Vec<Width>,
}

/// Searches with residuals weighted by what the search before left.
const SEARCHES: usize = 3;

/// Estimates the own values of the only recording among `experiments` over all its rows.
///
/// # Errors
/// None that checking the recording has not excluded.
pub(super) fn estimate(
    rig: &Rig,
    plant: &Plant,
    experiments: &[Experiment],
    values: &[f64],
) -> Result<Own> {
    let local = slots(plant);
    if local.is_empty() {
        return Ok(Own {
            values: values.to_vec(),
            widths: Vec::new(),
        });
    }
    let views = Views::new(rig, plant);
    let spreads = spreads(experiments);
    let mut problem = Problem::of_states(
        plant,
        experiments,
        spreads.iter().map(|spread| 1e-3 * spread).collect(),
        state_scales(plant, experiments, &views, values),
    );
    problem.local.clone_from(&local);
    let mut whole = [problem.segment(0, 0..experiments[0].rows())?];
    let guess = start::states(&problem, &views, &whole, values)?.swap_remove(0);
    let (shown, _) = start::estimate(&problem, 0, values, guess.clone())?;
    let mut state = best(&problem, &whole, values, [guess, shown]);
    for _ in 1..SEARCHES {
        let Some(rows) = problem.rows(&whole[0], values, &state) else {
            break;
        };
        let normal = problem.normal(&whole[0], &rows, &state);
        let sums = normal.squares.iter().zip(&normal.counts);
        for ((sigma, spread), (squares, count)) in problem.sigma.iter_mut().zip(&spreads).zip(sums)
        {
            let missed = (squares / (*count).max(1) as f64).sqrt();
            *sigma = (*sigma * missed).max(1e-7 * spread);
        }
        whole[0].anchor = start::estimate(&problem, 0, values, state.clone())?.1;
        state = best(&problem, &whole, values, [state.clone(), state]);
    }
    let unknowns = DecisionVariables {
        values: values.to_vec(),
        states: vec![state],
    };
    let mut widths = uncertainty::half_widths(&problem, &Prior::none(), &whole, &unknowns);
    let widths = widths.local.pop();
    let widths = widths.unwrap_or(vec![Width::Open; local.len()]);
    let mut own = values.to_vec();
    // A value that these rows leave open is the shared one.
    let known = (local.iter().zip(&widths).enumerate()).filter(|(_, it)| *it.1 != Width::Open);
    for (index, (&slot, _)) in known {
        let deviation = unknowns.states[0][plant.state_len() + index];
        own[slot] = problem.own_value(values, index, deviation);
    }
    Ok(Own {
        values: own,
        widths,
    })
}

/// The better end of a search from either state.
fn best(problem: &Problem, whole: &[Segment], values: &[f64], from: [Vec<f64>; 2]) -> Vec<f64> {
    let end = |state: Vec<f64>| start::settle(problem, whole, values, vec![state]).swap_remove(0);
    let cost = |state: &Vec<f64>| problem.cost(whole, values, std::slice::from_ref(state));
    let [a, b] = from;
    if a == b {
        return end(a);
    }
    let (a, b) = (end(a), end(b));
    if cost(&a) <= cost(&b) { a } else { b }
}
