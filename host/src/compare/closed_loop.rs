//! A controller against a plant: measure, command, advance one period, and so on.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::{Plant, Stepper};

use super::disturbance::Disturbance;
use super::reference::Reference;
use crate::dataset::gaussian;
use crate::error::Result;

/// Anything that turns measurements into commands once a period.
pub trait Controller {
    /// The commands for step `k`, from what was measured and what is asked from now on.
    ///
    /// # Errors
    /// The controller runs elsewhere and cannot be reached.
    fn command(&mut self, k: usize, y: &[f64], reference: &Reference) -> Result<Vec<f64>>;
}

/// What a controller is put to.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The plant; the controller does not see it.
    pub plant: Plant,
    /// Its parameters.
    pub values: Vec<f64>,
    /// Its state at the start.
    pub start: Vec<f64>,
    /// Indices of the sensors that are outputs.
    pub outputs: Vec<usize>,
    /// Standard deviation of each output's noise.
    pub noise: Vec<f64>,
    /// Seed of the noise.
    pub seed: u64,
    /// Control period, seconds.
    pub period_s: f64,
    /// What is asked.
    pub reference: Reference,
    /// What is added to the commands, and half the range of each input.
    pub load: (Disturbance, Vec<f64>),
}

/// A run, one row a step.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Time, seconds.
    pub t: Vec<f64>,
    /// What was asked, `[step][output]`.
    pub reference: Vec<Vec<f64>>,
    /// Where the outputs were, without the sensors' noise.
    pub y: Vec<Vec<f64>>,
    /// What the controller was told.
    pub measured: Vec<Vec<f64>>,
    /// What it commanded, `[step][input]`.
    pub u: Vec<Vec<f64>>,
}

impl Scenario {
    /// Runs the loop over the whole reference: a command follows every sample, is held for a period,
    /// and the error is taken where it leads.
    ///
    /// # Errors
    /// The plant diverges or the controller cannot be reached.
    pub fn run(&self, controller: &mut dyn Controller) -> Result<Run> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut stepper = Stepper::new(&self.plant, &self.values, &self.start)?;
        let mut run = Run::default();
        for k in 0..self.reference.steps() {
            let y: Vec<f64> = self
                .outputs
                .iter()
                .map(|sensor| stepper.signal(*sensor))
                .collect();
            let measured: Vec<f64> = y
                .iter()
                .zip(&self.noise)
                .map(|(y, noise)| y + noise * gaussian(&mut random))
                .collect();
            let u = controller.command(k, &measured, &self.reference)?;
            stepper.advance(self.period_s, &self.loaded(k, &u))?;
            run.t.push(k as f64 * self.period_s);
            run.reference.push(self.reference.row(k).to_vec());
            run.y.push(y);
            run.measured.push(measured);
            run.u.push(u);
        }
        Ok(run)
    }

    /// What the plant gets at step `k`.
    fn loaded(&self, k: usize, u: &[f64]) -> Vec<f64> {
        let (disturbance, range) = &self.load;
        if *disturbance == Disturbance::None {
            return u.to_vec();
        }
        let share = disturbance.at(k as f64 / self.reference.steps().max(1) as f64);
        u.iter()
            .zip(range)
            .map(|(u, range)| u + share * range)
            .collect()
    }
}

/// How well a run went.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Score {
    /// Root mean square tracking error of each output.
    pub rms: Vec<f64>,
    /// Largest tracking error of each output.
    pub max: Vec<f64>,
    /// Root mean square change of each command in one period.
    pub effort: Vec<f64>,
    /// Commands outside the rig's limits or rate limits.
    pub outside_limits: usize,
}

/// Limits of one input: lower, upper, change a period.
pub type InputLimits = (f64, f64, f64);

impl Run {
    /// Scores the run.
    pub fn score(&self, limits: &[InputLimits]) -> Score {
        let n = self.t.len().max(1) as f64;
        let outputs = self.y.first().map_or(0, Vec::len);
        let error = |r: usize| {
            self.y
                .iter()
                .zip(&self.reference)
                .map(move |(y, w)| y[r] - w[r])
        };
        let changes = |c: usize| self.u.windows(2).map(move |w| w[1][c] - w[0][c]);
        let outside = self.u.iter().enumerate().map(|(k, u)| {
            let bad = u
                .iter()
                .zip(limits)
                .enumerate()
                .any(|(c, (value, (low, high, change)))| {
                    let moved = if k > 0 { value - self.u[k - 1][c] } else { 0.0 };
                    // A command is an f32: the largest change it can make is rounded inwards by it.
                    !(low..=high).contains(&value) || moved.abs() > *change
                });
            usize::from(bad)
        });
        Score {
            rms: (0..outputs)
                .map(|r| (error(r).map(|e| e * e).sum::<f64>() / n).sqrt())
                .collect(),
            max: (0..outputs)
                .map(|r| error(r).fold(0.0, |m: f64, e| m.max(e.abs())))
                .collect(),
            effort: (0..limits.len())
                .map(|c| (changes(c).map(|d| d * d).sum::<f64>() / n).sqrt())
                .collect(),
            outside_limits: outside.sum(),
        }
    }
}
