//! Training of a policy through the plant: windows of the demonstration that grow, plants that
//! differ, and a choice by loops that train nothing (docs/explanation/imitation.md, eq. 5 and 6).

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sinew_sim::{Plant, SimulationError};

use crate::adam::Adam;
use crate::commands::Inverse;
use crate::policy::{Memory, Policy};
use crate::rollout::Conditions;

/// A motion to be learned, and the plants on which.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// The plant.
    pub plant: &'a Plant,
    /// Sensors that are outputs.
    pub outputs: &'a [usize],
    /// The motion, and the commands and states of the plant as written.
    pub motion: &'a Inverse,
    /// Control period, s.
    pub period_s: f64,
    /// Standard deviation of each output's noise.
    pub noise: &'a [f64],
    /// Largest load on each command while it learns.
    pub load: &'a [f64],
    /// Parameters of the plants that train.
    pub train: &'a [Vec<f64>],
    /// Parameters of the plants that choose.
    pub select: &'a [Vec<f64>],
}

/// Settings of a training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Steps of the optimiser at most.
    pub steps: usize,
    /// Windows a step.
    pub batch: usize,
    /// First length of a window, periods.
    pub first: usize,
    /// Largest step of a weight.
    pub rate: f64,
    /// Steps between two looks at the loops that choose.
    pub look: usize,
    /// Looks without a better one after which windows grow.
    pub patience: usize,
    /// Seed of everything drawn.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            steps: 3000,
            batch: 8,
            first: 16,
            rate: 3e-3,
            look: 20,
            patience: 3,
            seed: 1,
        }
    }
}

/// A look at the loops that choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Steps of the optimiser so far.
    pub step: usize,
    /// Periods of a window.
    pub window: usize,
    /// Mean RMS error of the loops that choose, of all outputs together; infinite where one
    /// diverged.
    pub rms: f64,
    /// The smallest so far.
    pub best: f64,
}

/// A policy that was trained.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The policy that the choosing loops preferred.
    pub policy: Policy,
    /// The looks.
    pub looks: Vec<Progress>,
}

impl Task<'_> {
    /// The loop from period `from` on, on a plant. From the first on it starts where that plant
    /// rests, later where the plant as written was.
    fn window<'a>(
        &'a self,
        policy: &Policy,
        values: &'a [f64],
        (from, steps): (usize, usize),
        seed: u64,
    ) -> Result<Conditions<'a>, SimulationError> {
        let (view, motion) = (&policy.view, self.motion);
        let mut memory = Memory::resting(view, &motion.y[0], &policy.limits.safe);
        for k in from.saturating_sub(view.past_outputs.max(view.past_inputs))..from {
            memory.measure(&motion.y[k]);
            memory.apply(&motion.u[k]);
        }
        let start = match from {
            0 => self.rest(values)?,
            _ => motion.x[from].clone(),
        };
        Ok(Conditions {
            plant: self.plant,
            values,
            start,
            memory,
            outputs: self.outputs,
            reference: &motion.y[from..],
            steps,
            period_s: self.period_s,
            noise: self.noise,
            load: vec![0.0; self.load.len()],
            seed,
        })
    }

    /// State in which a plant starts the motion.
    fn rest(&self, values: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let mut first = vec![None; self.plant.sensors().len()];
        for (i, sensor) in self.outputs.iter().enumerate() {
            first[*sensor] = Some(self.motion.y[0][i]);
        }
        self.plant.initial_state(values, &first)
    }

    /// RMS error of each plant's loop over the whole motion; infinite for one that diverges.
    pub fn judge(&self, policy: &Policy, plants: &[Vec<f64>], seed: u64) -> Vec<f64> {
        let steps = self.motion.u.len();
        let each = plants.par_iter().enumerate().map(|(i, values)| {
            let conditions = self.window(policy, values, (0, steps), seed + i as u64);
            let course = conditions.and_then(|conditions| conditions.run(policy));
            course.map_or(f64::INFINITY, |course| rms(&course.y, &self.motion.y))
        });
        each.collect()
    }

    /// Gradient of one window's RMS error.
    fn gradient(
        &self,
        policy: &Policy,
        (values, from, steps): (&[f64], usize, usize),
        load: &[f64],
        seed: u64,
    ) -> Option<(f64, Vec<f64>)> {
        let mut conditions = self.window(policy, values, (from, steps), seed).ok()?;
        conditions.load = load.to_vec();
        let tape = conditions.record(policy).ok()?;
        let wanted = &self.motion.y[from..=from + steps];
        let error = rms(&tape.course.y, wanted);
        let count = (steps + 1) as f64;
        let by_y: Vec<Vec<f64>> = (tape.course.y.iter().zip(wanted))
            .map(|(y, wanted)| {
                let each = y.iter().zip(wanted);
                each.map(|(y, wanted)| (y - wanted) / (count * error))
                    .collect()
            })
            .collect();
        let mut gradient = vec![0.0; policy.network.weights.len()];
        tape.backward(policy, &by_y, &mut gradient);
        gradient
            .iter()
            .all(|g| g.is_finite())
            .then_some((error, gradient))
    }
}

/// RMS length of the error of all outputs together.
pub fn rms(y: &[Vec<f64>], wanted: &[Vec<f64>]) -> f64 {
    let pairs = y.iter().flatten().zip(wanted.iter().flatten());
    let squares: f64 = pairs.map(|(y, wanted)| (y - wanted).powi(2)).sum();
    (squares / y.len().max(1) as f64).sqrt()
}

/// Trains a policy. `progress` hears of each look, and ends the training where it says false.
pub fn train(
    task: &Task<'_>,
    mut policy: Policy,
    options: &Options,
    progress: &mut dyn FnMut(&Progress) -> bool,
) -> Trained {
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let periods = task.motion.u.len();
    let mut window = options.first.min(periods);
    let mut adam = Adam::new(policy.network.weights.len());
    let (mut best, mut chosen) = (f64::INFINITY, policy.clone());
    let (mut stage_best, mut since) = (f64::INFINITY, 0);
    let mut looks = Vec::new();
    for step in 0..options.steps {
        let draws: Vec<(usize, usize, Vec<f64>, u64)> = (0..options.batch)
            .map(|_| {
                let plant = random.random_range(0..task.train.len());
                let from = random.random_range(0..=periods - window);
                let loads = task.load.iter();
                let loads = loads.map(|load| load * random.random_range(-1.0..=1.0));
                (plant, from, loads.collect(), random.random())
            })
            .collect();
        let found = draws.par_iter().map(|(plant, from, load, seed)| {
            task.gradient(&policy, (&task.train[*plant], *from, window), load, *seed)
        });
        let found: Vec<Option<(f64, Vec<f64>)>> = found.collect();
        let mut gradient = vec![0.0; policy.network.weights.len()];
        for (_, of_one) in found.iter().flatten() {
            // Each window counts alike, whatever the size of its gradient.
            let length = of_one.iter().map(|g| g * g).sum::<f64>().sqrt();
            for (all, g) in gradient.iter_mut().zip(of_one) {
                *all += g / length.max(f64::MIN_POSITIVE);
            }
        }
        let left = 1.0 - step as f64 / options.steps as f64;
        adam.step(
            &mut policy.network.weights,
            &gradient,
            options.rate * left.max(0.02),
        );
        if (step + 1) % options.look != 0 {
            continue;
        }
        let errors = task.judge(&policy, task.select, 1_000_000 + options.seed);
        let rms = errors.iter().sum::<f64>() / errors.len() as f64;
        if rms < best {
            best = rms;
            chosen = policy.clone();
        }
        since += 1;
        if rms < stage_best {
            stage_best = rms;
            since = 0;
        }
        let look = Progress {
            step: step + 1,
            window,
            rms,
            best,
        };
        looks.push(look);
        if !progress(&look) {
            break;
        }
        if since >= options.patience && window < periods {
            window = (2 * window).min(periods);
            (stage_best, since) = (f64::INFINITY, 0);
        }
    }
    Trained {
        policy: chosen,
        looks,
    }
}
