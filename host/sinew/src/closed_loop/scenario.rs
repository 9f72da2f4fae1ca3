//! A controller against a plant: measure, command, advance one period, and so on.

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::{Plant, Stepper};

use crate::closed_loop::disturbance::Disturbance;
use crate::closed_loop::plant_program::{PlantProgram, Running};
use crate::closed_loop::reference::Reference;
use sinew_ident::error::Result;
use sinew_ident::noise::gaussian;
use sinew_ident::recording::{Column, Recording};

/// Anything that turns measurements into commands once a period.
pub trait Controller {
    /// The commands for step `k`, from the outputs and channels that were measured and what is
    /// asked from now on.
    ///
    /// # Errors
    /// The controller runs elsewhere and cannot be reached.
    fn command(
        &mut self,
        k: usize,
        y: &[f64],
        s: &[f64],
        reference: &Reference,
    ) -> Result<Vec<f64>>;
}

/// One closed loop: plant, reference, disturbance and noise.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The plant; the controller does not see it. Where [`Scenario::program`] is the plant, this
    /// says what its signals are called.
    pub plant: Plant,
    /// Its parameters.
    pub values: Vec<f64>,
    /// Its state at the start.
    pub start: Vec<f64>,
    /// Indices of the sensors that are outputs.
    pub outputs: Vec<usize>,
    /// Standard deviation of each output's noise.
    pub noise: Vec<f64>,
    /// Indices of the sensors that are channels, and the standard deviation of each one's noise.
    pub channels: (Vec<usize>, Vec<f64>),
    /// Age of the measurements when the controller gets them, seconds; at the start what they were
    /// before is what they are.
    pub delay_s: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Control period, seconds.
    pub period_s: f64,
    /// Reference of the outputs.
    pub reference: Reference,
    /// Disturbance of the commands, and half the range of each input.
    pub load: (Disturbance, Vec<f64>),
    /// The program that is the plant instead; it starts where it likes.
    pub program: Option<PlantProgram>,
}

/// Course of a closed loop.
enum Process {
    Own(Box<Stepper<f64>>),
    Program(Box<Running>),
}

impl Process {
    fn start(scenario: &Scenario) -> Result<Self> {
        let Some(program) = &scenario.program else {
            let stepper = Stepper::new(&scenario.plant, &scenario.values, &scenario.start)?;
            return Ok(Self::Own(Box::new(stepper)));
        };
        let wanted = scenario.outputs.iter().chain(&scenario.channels.0);
        let wanted: Vec<usize> = wanted.copied().collect();
        let running = program.start(&scenario.plant, &wanted)?;
        Ok(Self::Program(Box::new(running)))
    }

    fn signal(&self, sensor: usize) -> f64 {
        match self {
            Self::Own(stepper) => stepper.signal(sensor),
            Self::Program(running) => running.signal(sensor),
        }
    }

    fn advance(&mut self, seconds: f64, inputs: &[f64]) -> Result<()> {
        match self {
            Self::Own(stepper) => Ok(stepper.advance(seconds, inputs)?),
            Self::Program(running) => running.advance(seconds, inputs),
        }
    }
}

/// A run, one row a step.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Time, seconds.
    pub t: Vec<f64>,
    /// Reference, `[step][output]`.
    pub reference: Vec<Vec<f64>>,
    /// Outputs without the sensors' noise.
    pub y: Vec<Vec<f64>>,
    /// Measurements of the controller.
    pub measured: Vec<Vec<f64>>,
    /// Commands, `[step][input]`.
    pub u: Vec<Vec<f64>>,
}

impl Scenario {
    /// Runs the loop over the whole reference: a command follows every sample, is held for a
    /// period, and the error is taken where it leads.
    ///
    /// # Errors
    /// The plant diverges or the controller cannot be reached.
    pub fn run(&self, controller: &mut dyn Controller) -> Result<Run> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut process = Process::start(self)?;
        let mut run = Run::default();
        let read = |process: &Process| -> Vec<f64> {
            let sensors = self.outputs.iter().chain(&self.channels.0);
            sensors.map(|sensor| process.signal(*sensor)).collect()
        };
        let noise: Vec<f64> = self.noise.iter().chain(&self.channels.1).copied().collect();
        let Delay { whole, part } = self.delay();
        let mut samples = vec![read(&process)];
        for k in 0..self.reference.steps() {
            let outputs = self.outputs.iter();
            let y: Vec<f64> = outputs.map(|sensor| process.signal(*sensor)).collect();
            let mut measured: Vec<f64> = samples[k.saturating_sub(whole)]
                .iter()
                .zip(&noise)
                .map(|(y, noise)| y + noise * gaussian(&mut random))
                .collect();
            let s = measured.split_off(y.len());
            let u = controller.command(k, &measured, &s, &self.reference)?;
            let loaded = self.loaded(k, &u);
            if part > 0.0 {
                process.advance(self.period_s - part, &loaded)?;
                samples.push(read(&process));
                process.advance(part, &loaded)?;
            } else {
                process.advance(self.period_s, &loaded)?;
                samples.push(read(&process));
            }
            run.t.push(k as f64 * self.period_s);
            run.reference.push(self.reference.row(k).to_vec());
            run.y.push(y);
            run.measured.push(measured);
            run.u.push(u);
        }
        Ok(run)
    }

    /// The delay in periods.
    pub fn delay(&self) -> Delay {
        let periods = self.delay_s / self.period_s;
        // What rounding leaves of a whole period is none.
        let whole = (periods + 1e-6) as usize;
        let part = (periods - whole as f64) * self.period_s;
        Delay {
            whole,
            part: if part > 1e-6 * self.period_s {
                part
            } else {
                0.0
            },
        }
    }

    /// Disturbance of each input at step `k`.
    pub fn loads(&self, k: usize) -> Vec<f64> {
        let (disturbance, range) = &self.load;
        if *disturbance == Disturbance::None {
            return vec![0.0; range.len()];
        }
        let share = disturbance.at(k as f64 / self.reference.steps().max(1) as f64);
        range.iter().map(|range| share * range).collect()
    }

    /// Input of the plant at step `k`.
    fn loaded(&self, k: usize, u: &[f64]) -> Vec<f64> {
        let loads = self.loads(k);
        u.iter().zip(&loads).map(|(u, load)| u + load).collect()
    }
}

/// A delay as so many whole periods and a part of one: the k-th sample is taken that part before
/// step k.
pub struct Delay {
    /// Whole periods.
    pub whole: usize,
    /// The rest, seconds.
    pub part: f64,
}

/// Length of the error of all outputs together, where they share a unit: a tip's distance from
/// where it should be.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Distance {
    /// Root mean square over the run.
    pub rms: f64,
    /// Largest of the run.
    pub max: f64,
}

/// Scores of a run.
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
    /// The samples from `from` to `to`, seconds.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        let within: Vec<bool> = self.t.iter().map(|t| (from..=to).contains(t)).collect();
        fn kept<T: Clone>(all: &[T], within: &[bool]) -> Vec<T> {
            let both = all.iter().zip(within);
            both.filter(|(_, kept)| **kept)
                .map(|(one, _)| one.clone())
                .collect()
        }
        Self {
            t: kept(&self.t, &within),
            reference: kept(&self.reference, &within),
            y: kept(&self.y, &within),
            measured: kept(&self.measured, &within),
            u: kept(&self.u, &within),
        }
    }

    /// Commands and measured outputs as a recording, in the columns' own units.
    ///
    /// # Errors
    /// As [`Recording::new`].
    pub fn recording(&self, plant: &Plant, outputs: &[usize], path: &Path) -> Result<Recording> {
        let column = |name: &str, rows: &[Vec<f64>], i: usize, factor: f64| Column {
            name: name.into(),
            values: rows.iter().map(|row| row[i] / factor).collect(),
        };
        let inputs = plant.inputs().iter().enumerate();
        let inputs = inputs.map(|(i, it)| column(&it.column, &self.u, i, it.column_factor));
        let sensors = outputs.iter().map(|sensor| &plant.sensors()[*sensor]);
        let sensors = sensors.enumerate();
        let sensors =
            sensors.map(|(i, it)| column(&it.column, &self.measured, i, it.column_factor));
        Recording::new(path, self.t.clone(), inputs.chain(sensors).collect())
    }

    /// Length of the error vector over the run.
    pub fn distance(&self) -> Distance {
        let lengths = self.y.iter().zip(&self.reference).map(|(y, w)| {
            let parts = y.iter().zip(w).map(|(y, w)| (y - w).powi(2));
            parts.sum::<f64>()
        });
        let (sum, most) = lengths.fold((0.0, 0.0_f64), |(sum, most), l| (sum + l, most.max(l)));
        Distance {
            rms: (sum / self.t.len().max(1) as f64).sqrt(),
            max: most.sqrt(),
        }
    }

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

#[cfg(test)]
mod tests {
    use sinew_sim::{Plant, Rig};

    use super::*;

    /// Pushes with what it was told, so that the run shows it.
    struct Echo;

    impl Controller for Echo {
        fn command(&mut self, k: usize, _: &[f64], _: &[f64], _: &Reference) -> Result<Vec<f64>> {
            Ok(vec![if k < 20 { 1.0 } else { -1.0 }])
        }
    }

    fn scenario(delay_s: f64) -> Scenario {
        let text = "format = \"sinew-rig/1\"\nname = \"cart\"\n[[body]]\nname = \"cart\"\nmotion = \"slide\"\n\
                    inertia = 1.0\n[[actuator]]\nname = \"push\"\ndrives = \"cart\"\ninput = \"u_N\"\ngain = 1.0\n\
                    [[sensor]]\nname = \"ruler\"\nreads = \"cart.position\"\nsignal = \"q_m\"\n";
        let rig = Rig::parse(text, "cart.toml").expect("the text is a rig");
        let plant = Plant::new(&rig).expect("the rig can be simulated");
        let values = plant.values();
        let start = plant
            .initial_state(&values, &[Some(0.0)])
            .expect("the scenario can start");
        Scenario {
            plant,
            values,
            start,
            outputs: vec![0],
            noise: vec![0.0],
            channels: (vec![], vec![]),
            delay_s,
            seed: 1,
            period_s: 0.01,
            reference: Reference {
                rows: vec![vec![0.0]; 41],
            },
            load: (Disturbance::None, vec![1.0]),
            program: None,
        }
    }

    #[test]
    fn a_delay_shows_what_was_and_leaves_the_plant_alone() {
        let of = |delay| scenario(delay).run(&mut Echo).expect("the run ends");
        let prompt = of(0.0);
        assert_eq!(prompt.measured, prompt.y);
        assert!(prompt.y[40 - 1][0] > 1e-2, "it never moved");
        for (delay, whole, part) in [(0.004, 0, 0.4), (0.01, 1, 0.0), (0.025, 2, 0.5)] {
            let late = of(delay);
            for k in 3..20 {
                assert!((late.y[k][0] - prompt.y[k][0]).abs() < 1e-12);
                // Constant acceleration from rest: q = t^2 / 2.
                let t = 0.01 * ((k - whole) as f64 - part);
                assert!(
                    (late.measured[k][0] - t * t / 2.0).abs() < 1e-9,
                    "{delay} {k}"
                );
            }
        }
    }

    #[test]
    fn a_stretch_of_a_run_is_scored_without_the_rest() {
        let run = scenario(0.0).run(&mut Echo).expect("the run ends");
        let stretch = run.between(run.t[5], run.t[9]);
        assert_eq!(stretch.t, run.t[5..=9]);
        assert_eq!(stretch.y, run.y[5..=9]);
        assert_eq!(stretch.u, run.u[5..=9]);
        let limits = [(-2.0, 2.0, 4.0)];
        // It moves away from what was asked, so the last sample is the worst.
        assert_eq!(stretch.score(&limits).max, [run.y[9][0].abs()]);
        assert!(run.score(&limits).max[0] > stretch.score(&limits).max[0]);
    }

    #[test]
    fn distance_is_the_length_of_the_error() {
        let run = Run {
            t: vec![0.0, 0.1],
            reference: vec![vec![0.0, 0.0]; 2],
            y: vec![vec![3.0, 4.0], vec![0.0, 1.0]],
            ..Run::default()
        };
        let found = run.distance();
        assert!((found.max - 5.0).abs() < 1e-12);
        assert!((found.rms - 13.0_f64.sqrt()).abs() < 1e-12);
    }
}
