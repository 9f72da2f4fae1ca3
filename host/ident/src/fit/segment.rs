//! Stretches of recordings with start states of their own, and what they say about the parameters.
//!
//! The unknowns are the free parameters `z` (scaled) and one start state `x` a segment. Over a
//! segment the normal equations of output-error least squares are
//! (docs/explanation/identification.md, eq. 5)
//! ```text
//! | A_zz A_zx | | dz |   | b_z |
//! | A_xz A_xx | | dx | = | b_x |
//! ```
//! and the segment's own `dx` is eliminated at once (eq. 6), so that a thousand segments cost no
//! more than one.

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sinew_sim::{Dual, InputTrajectory, ParameterizedPlant, Plant, Scalar, Simulated};

use super::experiment::Experiment;
use crate::error::Result;

/// A stretch of one recording, simulated from a start state of its own.
pub(crate) struct Segment {
    /// Index of the recording.
    pub experiment: usize,
    /// Rows of the recording.
    pub rows: Range<usize>,
    /// Prior of the initial state.
    pub anchor: InitialStatePrior,
    drive: InputTrajectory,
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
    fn distance(&self, state: &[f64], scale: &[f64]) -> DVector<f64> {
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

/// Normal equations of one segment, residuals in units of `sigma`.
pub(crate) struct Normal {
    pub zz: DMatrix<f64>,
    pub zx: DMatrix<f64>,
    pub xx: DMatrix<f64>,
    pub bz: DVector<f64>,
    pub bx: DVector<f64>,
    /// Sum of squared residuals of each sensor, in units of `sigma`, and how many there are.
    pub squares: Vec<f64>,
    pub counts: Vec<usize>,
}

/// A plant with numbers that carry derivatives, for many segments ([`Problem::seeded`]).
pub(crate) struct Seeded<'a, const D: usize> {
    width: usize,
    numbers: Vec<ParameterizedPlant<'a, Dual<D>>>,
}

/// A number whose `direction` is one of the `D` that are followed from `first` on, or none of them.
fn seed<const D: usize>(first: usize, direction: usize, value: f64, scale: f64) -> Dual<D> {
    let mut dual = Dual::constant(value);
    if (first..first + D).contains(&direction) {
        dual.derivative[direction - first] = scale;
    }
    dual
}

/// Residuals and their derivatives row by row: what uncertainty is made of.
pub(crate) struct Rows {
    /// Derivatives of the residual in `z` then `x`, one row a valid sample, flattened.
    pub jacobian: Vec<f64>,
    /// Residuals in units of `sigma`, one a valid sample.
    pub residual: Vec<f64>,
    /// The row of the recording and the sensor of each.
    pub origin: Vec<(usize, usize)>,
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
    /// # Errors
    /// As [`Experiment::drive`].
    pub fn new(
        plant: &Plant,
        experiments: &[Experiment],
        experiment: usize,
        rows: Range<usize>,
    ) -> Result<Self> {
        let drive = experiments[experiment].drive(plant, rows.clone())?;
        Ok(Self {
            experiment,
            rows,
            anchor: InitialStatePrior::loose(plant.state_len()),
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
        }
    }

    /// Number of fitted parameters.
    pub fn parameters(&self) -> usize {
        self.slots.len()
    }

    fn times<'b>(&'b self, segment: &Segment) -> &'b [f64] {
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
        let running = Running::new(segments.len());
        let numbers = self.numbers(segments, values.to_vec());
        let costs: Vec<f64> = segments
            .par_iter()
            .zip(states)
            .enumerate()
            .map(|(index, (segment, state))| {
                let signals = &self.experiments[segment.experiment].signals;
                let mut sum = 0.0;
                let mut read = Vec::with_capacity(signals.len());
                let held = segment.anchor.cost(state, &self.state_scale);
                let mut stopped = false;
                let run = numbers.simulate_until(
                    state,
                    &segment.drive,
                    self.times(segment),
                    |row, at| {
                        read.clear();
                        at.read(&mut read);
                        for ((column, signal), sigma) in signals.iter().zip(&read).zip(&self.sigma)
                        {
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
            })
            .collect();
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
        let run = self
            .plant
            .simulate(values, state, &segment.drive, self.times(segment))
            .ok()?;
        run.final_state
            .iter()
            .all(|x| x.is_finite())
            .then_some(run.final_state)
    }

    /// Every sensor's signal at every row of a segment, SI, row-major; `None` where the simulation
    /// fails.
    pub fn signals(&self, segment: &Segment, values: &[f64], state: &[f64]) -> Option<Vec<f64>> {
        let run = self
            .plant
            .simulate(values, state, &segment.drive, self.times(segment))
            .ok()?;
        run.signals
            .iter()
            .all(|signal| signal.is_finite())
            .then_some(run.signals)
    }

    /// The plant with numbers for all of these segments.
    fn numbers<S: Simulated>(
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

    /// The plant with numbers that carry derivatives in the first `width` directions, `D` at a
    /// time: parameters, then start states.
    pub fn seeded<const D: usize>(
        &self,
        segments: &[Segment],
        values: &[f64],
        width: usize,
    ) -> Seeded<'_, D>
    where
        Dual<D>: Simulated,
    {
        let firsts = (0..width.max(1)).step_by(D);
        let numbers = firsts.map(|first| {
            let mut duals: Vec<Dual<D>> = values.iter().map(|&x| Dual::constant(x)).collect();
            for (index, &slot) in self.slots.iter().enumerate() {
                duals[slot] = seed(first, index, values[slot], self.scale[index]);
            }
            self.numbers(segments, duals)
        });
        Seeded {
            width,
            numbers: numbers.collect(),
        }
    }

    /// Residuals and derivatives of one segment; `None` where the simulation fails.
    pub fn rows(&self, segment: &Segment, values: &[f64], state: &[f64]) -> Option<Rows> {
        let width = self.parameters() + state.len();
        let seeded = self.seeded::<4>(std::slice::from_ref(segment), values, width);
        self.rows_by(&seeded, segment, state)
    }

    /// The same with numbers that several segments share, the simulations in parallel.
    pub fn rows_by<const D: usize>(
        &self,
        seeded: &Seeded<D>,
        segment: &Segment,
        state: &[f64],
    ) -> Option<Rows>
    where
        Dual<D>: Simulated,
    {
        let width = seeded.width;
        let signals = &self.experiments[segment.experiment].signals;
        let sensors = signals.len();
        let origin: Vec<(usize, usize)> = segment
            .rows
            .clone()
            .flat_map(|row| (0..sensors).map(move |sensor| (row, sensor)))
            .filter(|&(row, sensor)| signals[sensor][row].is_finite())
            .collect();

        let simulated: Vec<Vec<Dual<D>>> = (seeded.numbers)
            .par_iter()
            .enumerate()
            .map(|(chunk, numbers)| {
                let state = self.seeded_state::<D>(chunk, state);
                let run = numbers
                    .simulate(&state, &segment.drive, self.times(segment))
                    .ok()?;
                run.signals
                    .iter()
                    .all(|signal| {
                        signal.value.is_finite() && signal.derivative.iter().all(|d| d.is_finite())
                    })
                    .then_some(run.signals)
            })
            .collect::<Option<_>>()?;

        let mut jacobian = Vec::with_capacity(origin.len() * width);
        let mut residual = Vec::with_capacity(origin.len());
        for &(row, sensor) in &origin {
            let at = (row - segment.rows.start) * sensors + sensor;
            residual.push((signals[sensor][row] - simulated[0][at].value) / self.sigma[sensor]);
            let derivatives = simulated.iter().flat_map(|chunk| chunk[at].derivative);
            jacobian.extend(
                derivatives
                    .take(width)
                    .map(|derivative| derivative / self.sigma[sensor]),
            );
        }
        Some(Rows {
            jacobian,
            residual,
            origin,
        })
    }

    /// State at the end of a segment with its derivatives, `D` directions at a time; `None` where
    /// the simulation fails.
    pub fn final_states<const D: usize>(
        &self,
        seeded: &Seeded<D>,
        segment: &Segment,
        state: &[f64],
    ) -> Option<Vec<Vec<Dual<D>>>>
    where
        Dual<D>: Simulated,
    {
        let ends = seeded.numbers.iter().enumerate().map(|(chunk, numbers)| {
            let start = self.seeded_state::<D>(chunk, state);
            let run = numbers.simulate(&start, &segment.drive, self.times(segment));
            Some(run.ok()?.final_state)
        });
        ends.collect()
    }

    /// Initial state with derivatives in the directions of a chunk.
    fn seeded_state<const D: usize>(&self, chunk: usize, state: &[f64]) -> Vec<Dual<D>> {
        let states = state.iter().enumerate();
        let seeded = states.map(|(index, &x)| {
            let direction = self.parameters() + index;
            seed(chunk * D, direction, x, self.state_scale[index])
        });
        seeded.collect()
    }

    /// Normal equations of every segment at the present unknowns; `None` where a simulation fails.
    pub fn linearise(
        &self,
        segments: &[Segment],
        values: &[f64],
        states: &[Vec<f64>],
    ) -> Option<Vec<Normal>> {
        let width = self.parameters() + self.state_scale.len();
        // Few segments: narrow simulations keep every core busy. Many: wide ones share the
        // arithmetic.
        let wide = segments.len() * width.div_ceil(8) >= rayon::current_num_threads();
        if wide {
            self.normals(&self.seeded::<8>(segments, values, width), segments, states)
        } else {
            self.normals(&self.seeded::<4>(segments, values, width), segments, states)
        }
    }

    fn normals<const D: usize>(
        &self,
        seeded: &Seeded<D>,
        segments: &[Segment],
        states: &[Vec<f64>],
    ) -> Option<Vec<Normal>>
    where
        Dual<D>: Simulated,
    {
        let normal = |(segment, state): (&Segment, &Vec<f64>)| {
            let rows = self.rows_by(seeded, segment, state)?;
            Some(self.normal(segment, &rows, state))
        };
        segments.par_iter().zip(states).map(normal).collect()
    }

    /// Squares of the derivatives in each parameter, summed over all segments; `None` where a
    /// simulation fails.
    pub fn sensitivities(
        &self,
        segments: &[Segment],
        values: &[f64],
        states: &[Vec<f64>],
    ) -> Option<(Vec<f64>, usize)> {
        let width = self.parameters();
        let seeded = self.seeded::<4>(segments, values, width);
        let of = |(segment, state): (&Segment, &Vec<f64>)| {
            let rows = self.rows_by(&seeded, segment, state)?;
            let mut squares = vec![0.0; width];
            for row in rows.jacobian.chunks_exact(width.max(1)) {
                for (sum, x) in squares.iter_mut().zip(row) {
                    *sum += x * x;
                }
            }
            Some((squares, rows.residual.len()))
        };
        let each: Vec<_> = (segments.par_iter().zip(states))
            .map(of)
            .collect::<Option<_>>()?;
        // In the order of the segments, so that the sums do not depend on who finished first.
        let squares = |j: usize| each.iter().map(|(squares, _)| squares[j]).sum();
        let samples = each.iter().map(|(_, samples)| samples).sum();
        Some(((0..width).map(squares).collect(), samples))
    }

    /// Sums rows into normal equations, and adds what is known of the start.
    pub fn normal(&self, segment: &Segment, rows: &Rows, state: &[f64]) -> Normal {
        let (parameters, states) = (self.parameters(), state.len());
        let width = parameters + states;
        let sensors = self.sigma.len();
        let mut full = DMatrix::<f64>::zeros(width, width);
        let mut right = DVector::<f64>::zeros(width);
        let (mut squares, mut counts) = (vec![0.0; sensors], vec![0; sensors]);
        for ((row, residual), (_, sensor)) in rows
            .jacobian
            .chunks_exact(width.max(1))
            .zip(&rows.residual)
            .zip(&rows.origin)
        {
            squares[*sensor] += residual * residual;
            counts[*sensor] += 1;
            for (j, &by) in row.iter().enumerate() {
                right[j] += by * residual;
                let column = &mut full.as_mut_slice()[j * width..(j + 1) * width];
                for (sum, x) in column[j..].iter_mut().zip(&row[j..]) {
                    *sum += x * by;
                }
            }
        }
        full.fill_upper_triangle_with_lower_triangle();
        let anchor = &segment.anchor;
        let xx = full.view((parameters, parameters), (states, states)) + &anchor.weight;
        let pull = &anchor.weight * anchor.distance(state, &self.state_scale);
        let bx = right.rows(parameters, states) - pull;
        Normal {
            zz: full.view((0, 0), (parameters, parameters)).into_owned(),
            zx: full
                .view((0, parameters), (parameters, states))
                .into_owned(),
            bz: right.rows(0, parameters).into_owned(),
            xx,
            bx,
            squares,
            counts,
        }
    }
}
