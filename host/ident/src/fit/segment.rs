//! Stretches of recordings with start states of their own, and what parameters and start states
//! leave of them.

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{DMatrix, DVector};
use sinew_sim::{InputTrajectory, ParameterizedPlant, Plant, Simulated, Trajectory};

use super::experiment::Experiment;
use crate::error::Result;
use crate::parallel;

/// State from which the rest of each row is searched, table by table.
pub(crate) type RestStarts = [Vec<Vec<f64>>];

/// A stretch of one recording, simulated from a start state of its own.
pub(crate) struct Segment {
    /// Index of the recording.
    pub experiment: usize,
    /// Rows of the recording.
    pub rows: Range<usize>,
    /// Prior of the initial state.
    pub anchor: InitialStatePrior,
    pub(super) drive: InputTrajectory,
}

/// Data that all shooting segments share during a search.
#[derive(Clone)]
pub(crate) struct Problem<'a> {
    pub plant: &'a Plant,
    pub experiments: &'a [Experiment],
    /// Slots of the parameters that are fitted.
    pub slots: Vec<usize>,
    /// One unit of `z` in each of them, SI.
    pub scale: Vec<f64>,
    /// One unit of residual for each sensor, SI.
    pub sigma: Vec<f64>,
    /// Natural size of each state, SI: one unit of `x`.
    pub state_scale: Vec<f64>,
    /// Slots of the parameters of which each segment has a value of its own; their deviations are
    /// the last states of a segment.
    pub local: Vec<usize>,
    /// Rows are rests instead of a motion ([`super::statics`]).
    pub rests: Option<&'a RestStarts>,
}

/// Gaussian prior of a segment's initial state (arrival cost): `(x - mean)' weight (x - mean)`
/// is added to the squares (docs/explanation/identification.md, eq. 3).
#[derive(Clone)]
pub(crate) struct InitialStatePrior {
    /// In units of `Problem::state_scale`.
    pub mean: DVector<f64>,
    pub weight: DMatrix<f64>,
}

impl InitialStatePrior {
    /// Next to nothing: a state moves ten times as far as it was ever seen to before this is felt.
    /// It holds a state that no sensor shows.
    pub fn loose(states: usize) -> Self {
        Self {
            mean: DVector::zeros(states),
            weight: DMatrix::identity(states, states) * 0.01,
        }
    }

    /// Distance of a state from the mean, in units of its scale.
    pub(super) fn distance(&self, state: &[f64], scale: &[f64]) -> DVector<f64> {
        DVector::from_iterator(
            state.len(),
            state.iter().zip(scale).map(|(x, scale)| x / scale),
        ) - &self.mean
    }

    fn cost(&self, state: &[f64], scale: &[f64]) -> f64 {
        let distance = self.distance(state, scale);
        0.5 * distance.dot(&(&self.weight * &distance))
    }
}

/// Rows between two looks at what all segments have cost so far.
const LOOK: usize = 16;

/// Cost of each segment so far.
struct Running(Vec<AtomicU64>);

impl Running {
    fn new(segments: usize) -> Self {
        Self((0..segments).map(|_| AtomicU64::new(0)).collect())
    }

    /// Notes what a segment has come to, and says whether all together exceed `most`.
    fn exceeds(&self, segment: usize, cost: f64, most: f64) -> bool {
        self.0[segment].store(cost.to_bits(), Ordering::Relaxed);
        let so_far = |cost: &AtomicU64| f64::from_bits(cost.load(Ordering::Relaxed));
        self.0.iter().map(so_far).sum::<f64>() > most
    }
}

impl Segment {
    /// A segment with this number of states; [`Problem::segment`] knows it.
    ///
    /// # Errors
    /// As [`Experiment::drive`].
    pub fn new(
        plant: &Plant,
        experiments: &[Experiment],
        experiment: usize,
        rows: Range<usize>,
        states: usize,
    ) -> Result<Self> {
        let drive = experiments[experiment].drive(plant, rows.clone())?;
        Ok(Self {
            experiment,
            rows,
            anchor: InitialStatePrior::loose(states),
            drive,
        })
    }
}

impl<'a> Problem<'a> {
    /// The same problem with every parameter fixed: only the initial states are fitted.
    pub fn states_only(&self) -> Self {
        Self {
            slots: Vec::new(),
            scale: Vec::new(),
            ..self.clone()
        }
    }

    /// A problem in which only the initial states are fitted.
    pub fn of_states(
        plant: &'a Plant,
        experiments: &'a [Experiment],
        sigma: Vec<f64>,
        state_scale: Vec<f64>,
    ) -> Self {
        Self {
            plant,
            experiments,
            slots: Vec::new(),
            scale: Vec::new(),
            sigma,
            state_scale,
            local: Vec::new(),
            rests: None,
        }
    }

    /// Number of fitted parameters.
    pub fn parameters(&self) -> usize {
        self.slots.len()
    }

    /// Values of the fitted parameters, SI.
    pub(super) fn of_slots(&self, values: &[f64]) -> Vec<f64> {
        self.slots.iter().map(|&slot| values[slot]).collect()
    }

    pub(super) fn times<'b>(&'b self, segment: &Segment) -> &'b [f64] {
        &self.experiments[segment.experiment].t[segment.rows.clone()]
    }

    /// Half the sum of squared residuals over all segments; infinite where a simulation fails.
    pub fn cost(&self, segments: &[Segment], values: &[f64], states: &[Vec<f64>]) -> f64 {
        self.cost_below(segments, values, states, f64::INFINITY)
    }

    /// As [`Problem::cost`]; infinite as well where it exceeds `most`, and then the simulations end
    /// as soon as that is certain. Squares only add up, so which segment is ahead matters only to a
    /// cost that is `most` to rounding.
    pub fn cost_below(
        &self,
        segments: &[Segment],
        values: &[f64],
        states: &[Vec<f64>],
        most: f64,
    ) -> f64 {
        if let Some(starts) = self.rests {
            let cost = self.cost_of_rests(starts, segments, values);
            return if cost <= most { cost } else { f64::INFINITY };
        }
        let running = Running::new(segments.len());
        let shared = self.numbers(segments, values.to_vec());
        let costs = parallel::indexed(segments.len().min(states.len()), &|index| {
            let (segment, state) = (&segments[index], &states[index]);
            let signals = &self.experiments[segment.experiment].signals;
            let mut sum = 0.0;
            let mut read = Vec::with_capacity(signals.len());
            let held = segment.anchor.cost(state, &self.state_scale);
            let mut stopped = false;
            let own = (!self.local.is_empty()).then(|| {
                let values = self.values_at(values, state).into_owned();
                self.numbers(std::slice::from_ref(segment), values)
            });
            let run = own.as_ref().unwrap_or(&shared).simulate_until(
                self.plant_state(state),
                &segment.drive,
                self.times(segment),
                |row, at| {
                    read.clear();
                    at.read(&mut read);
                    for ((column, signal), sigma) in signals.iter().zip(&read).zip(&self.sigma) {
                        let measured = column[segment.rows.start + row];
                        if measured.is_finite() {
                            sum += ((measured - signal) / sigma).powi(2);
                        }
                    }
                    stopped = row % LOOK == 0 && running.exceeds(index, 0.5 * sum + held, most);
                    if stopped {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                },
            );
            if run.is_ok() && sum.is_finite() && !stopped {
                0.5 * sum + held
            } else {
                running.exceeds(index, f64::INFINITY, most);
                f64::INFINITY
            }
        });
        // In the order of the segments, so that the sum does not depend on who finished first.
        let cost = costs.iter().sum();
        if cost <= most { cost } else { f64::INFINITY }
    }

    /// The state at the end of a segment, or `None` where the simulation fails.
    pub fn final_state(
        &self,
        segment: &Segment,
        values: &[f64],
        state: &[f64],
    ) -> Option<Vec<f64>> {
        let run = self.run(segment, values, state)?;
        let finite = run.final_state.iter().all(|x| x.is_finite());
        let deviations = &state[self.plant.state_len()..];
        finite.then(|| [&run.final_state[..], deviations].concat())
    }

    /// Every sensor's signal at every row of a segment, SI, row-major; `None` where the simulation
    /// fails.
    pub fn signals(&self, segment: &Segment, values: &[f64], state: &[f64]) -> Option<Vec<f64>> {
        let run = self.run(segment, values, state)?;
        run.signals
            .iter()
            .all(|signal| signal.is_finite())
            .then_some(run.signals)
    }

    /// Simulates a segment; `None` where that fails.
    fn run(&self, segment: &Segment, values: &[f64], state: &[f64]) -> Option<Trajectory<f64>> {
        let own = self.values_at(values, state);
        let start = self.plant_state(state);
        let run = self
            .plant
            .simulate(&own, start, &segment.drive, self.times(segment));
        run.ok()
    }

    /// The plant with numbers for all of these segments.
    pub(super) fn numbers<S: Simulated>(
        &self,
        segments: &[Segment],
        values: Vec<S>,
    ) -> ParameterizedPlant<'_, S> {
        let interval = segments.first().map_or(0.0, |first| {
            let times = self.times(first);
            times.get(1).map_or(0.0, |second| second - times[0])
        });
        self.plant.parameterized(values, interval)
    }
}
