//! Residuals of shooting segments with their derivatives, and the normal equations they make.
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

use nalgebra::{DMatrix, DVector};
use sinew_sim::{Dual, ParameterizedPlant, Scalar, Simulated};

use super::segment::{Problem, Segment};
use crate::parallel;

/// Normal equations of one segment, residuals in units of `sigma`.
#[derive(Clone)]
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
    /// The shared values.
    values: Vec<f64>,
    /// Empty where each segment has values of its own.
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

impl Problem<'_> {
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
        Seeded {
            width,
            values: values.to_vec(),
            numbers: if self.local.is_empty() {
                self.seeds(segments, values, width)
            } else {
                Vec::new()
            },
        }
    }

    /// Numbers with derivatives, `D` directions at a time.
    fn seeds<const D: usize>(
        &self,
        segments: &[Segment],
        values: &[f64],
        width: usize,
    ) -> Vec<ParameterizedPlant<'_, Dual<D>>>
    where
        Dual<D>: Simulated,
    {
        let own = self.parameters() + self.plant.state_len();
        let firsts = (0..width.max(1)).step_by(D);
        let numbers = firsts.map(|first| {
            let mut duals: Vec<Dual<D>> = values.iter().map(|&x| Dual::constant(x)).collect();
            for (index, &slot) in self.slots.iter().enumerate() {
                duals[slot] = seed(first, index, values[slot], self.scale[index]);
            }
            for (index, &slot) in self.local.iter().enumerate() {
                let scale = self.state_scale[self.plant.state_len() + index];
                duals[slot] = seed(first, own + index, values[slot], scale);
            }
            self.numbers(segments, duals)
        });
        numbers.collect()
    }

    /// Numbers of a segment with values of its own; `None` where all share them.
    fn own_seeds<const D: usize>(
        &self,
        seeded: &Seeded<D>,
        segment: &Segment,
        state: &[f64],
    ) -> Option<Vec<ParameterizedPlant<'_, Dual<D>>>>
    where
        Dual<D>: Simulated,
    {
        (!self.local.is_empty()).then(|| {
            let values = self.values_at(&seeded.values, state);
            self.seeds(std::slice::from_ref(segment), &values, seeded.width)
        })
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

        let own = self.own_seeds(seeded, segment, state);
        let numbers = own.as_ref().unwrap_or(&seeded.numbers);
        let simulated: Vec<Vec<Dual<D>>> = parallel::all(numbers.len(), &|chunk| {
            let numbers = &numbers[chunk];
            let signals = match self.rests {
                Some(starts) => self.signals_at_rest(starts, segment, numbers.values())?,
                None => {
                    let state = self.seeded_state::<D>(chunk, state);
                    let run = numbers.simulate(&state, &segment.drive, self.times(segment));
                    run.ok()?.signals
                }
            };
            let finite = |signal: &Dual<D>| {
                signal.value.is_finite() && signal.derivative.iter().all(|d| d.is_finite())
            };
            signals.iter().all(finite).then_some(signals)
        })?;

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
        let own = self.own_seeds(seeded, segment, state);
        let numbers = own.as_ref().unwrap_or(&seeded.numbers);
        let ends = numbers.iter().enumerate().map(|(chunk, numbers)| {
            let start = self.seeded_state::<D>(chunk, state);
            let run = numbers.simulate(&start, &segment.drive, self.times(segment));
            Some(run.ok()?.final_state)
        });
        ends.collect()
    }

    /// The plant's initial state with derivatives in the directions of a chunk.
    fn seeded_state<const D: usize>(&self, chunk: usize, state: &[f64]) -> Vec<Dual<D>> {
        let states = self.plant_state(state).iter().enumerate();
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
        parallel::all(segments.len().min(states.len()), &|index| {
            let (segment, state) = (&segments[index], &states[index]);
            let rows = self.rows_by(seeded, segment, state)?;
            Some(self.normal(segment, &rows, state))
        })
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
        let each = parallel::all(segments.len().min(states.len()), &|index| {
            let rows = self.rows_by(&seeded, &segments[index], &states[index])?;
            let mut squares = vec![0.0; width];
            for row in rows.jacobian.chunks_exact(width.max(1)) {
                for (sum, x) in squares.iter_mut().zip(row) {
                    *sum += x * x;
                }
            }
            Some((squares, rows.residual.len()))
        })?;
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
