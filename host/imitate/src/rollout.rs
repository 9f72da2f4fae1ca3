//! Closed loops of a policy and a plant, plain or with the derivatives of each period
//! (docs/explanation/imitation.md, eq. 5).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_ident::noise::gaussian;
use sinew_sim::{Plant, SimulationError, Stepper};

use crate::period::Linearised;
use crate::policy::{Memory, Policy, Step};

/// Conditions of one loop.
#[derive(Clone, Debug)]
pub struct Conditions<'a> {
    /// The plant.
    pub plant: &'a Plant,
    /// Its parameters, SI.
    pub values: &'a [f64],
    /// State at the start ([`Plant::state_names`]).
    pub start: Vec<f64>,
    /// Past of the loop before its first sample.
    pub memory: Memory,
    /// Sensors that are outputs.
    pub outputs: &'a [usize],
    /// Reference, a row a period from the first sample on; the last one is held.
    pub reference: &'a [Vec<f64>],
    /// Control steps.
    pub steps: usize,
    /// Control period, s.
    pub period_s: f64,
    /// Standard deviation of each output's noise.
    pub noise: &'a [f64],
    /// Load added to each command on its way to the plant.
    pub load: Vec<f64>,
    /// Seed of the noise.
    pub seed: u64,
}

/// Course of a loop: `y` has one row more than `u`, where the last command led. Outputs are without
/// noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// Outputs.
    pub y: Vec<Vec<f64>>,
    /// Commands.
    pub u: Vec<Vec<f64>>,
}

/// A loop with the derivatives of each period.
pub(crate) struct Tape {
    pub course: Course,
    pub steps: Vec<Step>,
    /// Of each period, row by row: next state, then next outputs, by state and commands.
    pub slopes: Vec<Vec<f64>>,
    pub states: usize,
}

type Result<T> = std::result::Result<T, SimulationError>;

impl Conditions<'_> {
    fn row(&self, k: usize) -> &[f64] {
        &self.reference[k.min(self.reference.len() - 1)]
    }

    /// Runs the loop.
    ///
    /// # Errors
    /// The plant diverges.
    pub fn run(&self, policy: &Policy) -> Result<Course> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut plant = Stepper::new(self.plant, self.values, &self.start)?;
        let mut memory = self.memory.clone();
        let mut course = Course::default();
        let read = |plant: &Stepper<f64>| -> Vec<f64> {
            self.outputs.iter().map(|s| plant.signal(*s)).collect()
        };
        course.y.push(read(&plant));
        for k in 0..self.steps {
            self.measure(&course.y[k], &mut memory, &mut random);
            let u = policy.commands(&policy.raw(&memory, |j| self.row(k + j)));
            plant.advance(self.period_s, &self.loaded(&u))?;
            memory.apply(&u);
            course.y.push(read(&plant));
            course.u.push(u);
        }
        Ok(course)
    }

    fn measure(&self, y: &[f64], memory: &mut Memory, random: &mut ChaCha8Rng) {
        let noisy = y.iter().zip(self.noise);
        let noisy: Vec<f64> = noisy
            .map(|(y, noise)| y + noise * gaussian(random))
            .collect();
        memory.measure(&noisy);
    }

    fn loaded(&self, u: &[f64]) -> Vec<f64> {
        u.iter().zip(&self.load).map(|(u, load)| u + load).collect()
    }

    /// Runs the loop and keeps what its gradient needs.
    ///
    /// # Errors
    /// The plant diverges.
    pub(crate) fn record(&self, policy: &Policy) -> Result<Tape> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let start = Stepper::new(self.plant, self.values, &self.start)?;
        let mut plant = Linearised::new(self.plant, self.values, &self.start)?;
        let mut memory = self.memory.clone();
        let mut tape = Tape {
            course: Course::default(),
            steps: Vec::with_capacity(self.steps),
            slopes: Vec::with_capacity(self.steps),
            states: self.start.len(),
        };
        let mut y: Vec<f64> = self.outputs.iter().map(|s| start.signal(*s)).collect();
        let mut x = self.start.clone();
        for k in 0..self.steps {
            self.measure(&y, &mut memory, &mut random);
            tape.course.y.push(y);
            let step = policy.step(&policy.raw(&memory, |j| self.row(k + j)));
            memory.apply(&step.u);
            let period = plant.advance(&x, &self.loaded(&step.u), self.period_s, self.outputs)?;
            (x, y) = (period.x, period.y);
            tape.slopes.push(period.slopes);
            tape.course.u.push(step.u.clone());
            tape.steps.push(step);
        }
        tape.course.y.push(y);
        Ok(tape)
    }
}
