//! Plants that run away by themselves (docs/explanation/identification.md, eq. 15).
//!
//! An unstable plant multiplies a small error of its initial state by `exp(rate t)`. Held upright
//! by a controller for long, its recording says much about the parameters over short shooting
//! intervals, and its free run over the whole says nothing.

use nalgebra::DMatrix;
use sinew_sim::Dual;

use super::levenberg::DecisionVariables;
use super::segment::{Problem, Segment};
use crate::parallel;

/// Largest growth over a shooting interval. The normal equations of an initial state have the
/// square of it as their condition, and are damped by 1e-13 of their diagonal.
const MOST_GROWTH: f64 = 1e6;

/// Smallest growth over a recording that counts as running away: what integrates, oscillates or
/// sticks grows by about 1.
const RUNS_AWAY: f64 = 1e3;

/// Plant that runs away by itself along the recordings of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Runaway {
    /// Exponential growth of a small error of the initial state, 1/s.
    pub rate: f64,
    /// Time after which the noise of one reading has grown to 0.3 of the signal, s: free runs over
    /// longer recordings say nothing.
    pub blind_after: f64,
    /// Longest shooting interval of the fit, s.
    pub interval: f64,
    /// The longest shooting interval is the longest recording.
    pub whole: bool,
}

impl Runaway {
    /// Judges the growth along the shooting segments of a fit; `None` where the plant is stable
    /// enough for free runs over the recordings. The segments of a recording follow each other in
    /// time.
    pub(super) fn along(
        problem: &Problem,
        segments: &[Segment],
        unknowns: &DecisionVariables,
        spreads: &[f64],
    ) -> Option<Self> {
        let times = |segment: &Segment| {
            let t = &problem.experiments[segment.experiment].t;
            t[segment.rows.end - 1] - t[segment.rows.start]
        };
        let states = &unknowns.states;
        let transitions = parallel::indexed(segments.len().min(states.len()), &|index| {
            problem.transition(&segments[index], &unknowns.values, &states[index])
        });
        let states = problem.plant.state_len();
        let mut fastest: Option<f64> = None;
        for index in 0..problem.experiments.len() {
            let mut product = DMatrix::<f64>::identity(states, states);
            let mut lasted = 0.0;
            for (segment, transition) in segments.iter().zip(&transitions) {
                if segment.experiment == index {
                    product = transition.as_ref()? * product;
                    lasted += times(segment);
                }
            }
            let growth = spectral_radius(product)?;
            if growth > RUNS_AWAY && lasted > 0.0 {
                let rate = growth.ln() / lasted;
                fastest = Some(fastest.map_or(rate, |fastest| fastest.max(rate)));
            }
        }
        let rate = fastest?;
        let noise = problem.sigma.iter().zip(spreads);
        let noise = noise.map(|(sigma, spread)| sigma / spread);
        let noise = noise.fold(0.0, f64::max);
        Some(Self {
            rate,
            blind_after: ((super::POOR / noise).ln() / rate).max(0.0),
            interval: segments.iter().map(times).fold(0.0, f64::max),
            whole: segments.len() == problem.experiments.len(),
        })
    }

    /// Longest shooting interval that normal equations bear, s.
    pub(super) fn longest_interval(&self) -> f64 {
        MOST_GROWTH.ln() / self.rate
    }
}

/// Largest absolute eigenvalue; `None` where an entry is no number.
fn spectral_radius(matrix: DMatrix<f64>) -> Option<f64> {
    let finite = matrix.iter().all(|entry| entry.is_finite());
    let eigenvalues = finite.then(|| matrix.complex_eigenvalues())?;
    let sizes = eigenvalues.iter().map(|value| value.norm());
    Some(sizes.fold(0.0, f64::max))
}

impl Problem<'_> {
    /// Derivative of the state at the end of a segment by its initial state, both in units of
    /// `state_scale`; `None` where the simulation fails.
    fn transition(&self, segment: &Segment, values: &[f64], state: &[f64]) -> Option<DMatrix<f64>> {
        const WIDTH: usize = 4;
        let states = self.plant.state_len();
        let held = self.states_only();
        let seeded = held.seeded::<WIDTH>(std::slice::from_ref(segment), values, states);
        let ends: Vec<Vec<Dual<WIDTH>>> = held.final_states(&seeded, segment, state)?;
        let scale = &self.state_scale;
        Some(DMatrix::from_fn(states, states, |row, column| {
            ends[column / WIDTH][row].derivative[column % WIDTH] / scale[row]
        }))
    }
}
