//! Cost of a plan: misses at the goals, distance from a path, effort and change of the commands
//! (docs/explanation/planning.md, eq. 2).

use std::path::Path;

use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;
use sinew_sim::{InputTrajectory, Plant, SimulationError, SimulationSettings};

use crate::count::{Count, Counter};
use crate::goal::Goal;
use crate::layout::Layout;
use crate::options::Options;
use crate::quantity::Quantity;
use crate::target::{self, Target};

/// Part of the range in a probe that stands for a distance where a goal asks for none.
const PART_OF_RANGE: f64 = 0.1;

/// Longest sub-step on the central path, in units of one over the fastest rate.
const GUIDING_STEP: f64 = 0.4;

/// A planning problem: a plant at its start, targets, and commands inside limits.
///
/// The decision variables are knots of the commands, each divided by the largest magnitude that
/// its limits allow: all knots of the first input, then those of the second.
#[derive(Debug)]
pub struct PlanProblem {
    pub(crate) plant: Plant,
    pub(crate) values: Vec<f64>,
    pub(crate) start: Vec<f64>,
    pub(crate) layout: Layout,
    pub(crate) targets: Vec<Target>,
    /// Weight of effort and of change, each.
    pub(crate) effort: f64,
    pub(crate) counter: Counter,
}

impl PlanProblem {
    /// Checks goals and path and takes the two simulations that the scales come from.
    ///
    /// `file` is the rig's, for errors; `path` has columns named as sensors or states.
    ///
    /// # Errors
    /// `Arguments` for a goal that names nothing or lies beyond the horizon, and for options that
    /// make no sense; `File` for an input without limits and for a path without a usable column;
    /// `Simulation` where the rig cannot be simulated.
    pub fn new(
        plant: &Plant,
        file: &Path,
        goals: &[Goal],
        path: Option<&Recording>,
        options: &Options,
    ) -> Result<Self> {
        if plant.inputs().is_empty() {
            return Err(Error::file(
                file,
                "the rig has no actuator: nothing can move it",
            ));
        }
        if let Some(reason) = plant.only_recordings() {
            let message = format!("only a recording can drive this rig: {reason}");
            return Err(Error::file(file, message).expected("a rig that its actuators alone drive"));
        }
        let t = options.times(goals, path)?;
        let mut targets = target::of_goals(plant, goals, &t)?;
        if let Some(path) = path {
            targets.extend(target::of_path(plant, path, &t)?);
        }
        if targets.is_empty() {
            return Err(Error::arguments("no goal to plan for")
                .help("name one, for example --goal \"mass.position = 0.12 at 1.5 s\""));
        }
        let values = plant.values();
        let first = vec![None; plant.sensors().len()];
        let start = plant.initial_state(&values, &first)?;
        let mut problem = Self {
            plant: plant.with_settings(SimulationSettings {
                max_substeps: options.max_substeps,
                ..plant.settings()
            }),
            values,
            start,
            layout: Layout::new(plant, file, t, options.knots)?,
            targets,
            effort: options.effort,
            counter: Counter::default(),
        };
        problem.scale()?;
        Ok(problem)
    }

    /// Number of decision variables.
    pub fn variables(&self) -> usize {
        self.layout.variables()
    }

    /// Simulations so far.
    pub fn count(&self) -> Count {
        self.counter.count()
    }

    /// Variables of commands at rest.
    pub fn rest(&self) -> Vec<f64> {
        self.layout.rest()
    }

    /// Brings variables inside limits and rate limits.
    pub fn project(&self, x: &mut [f64]) {
        self.layout.project(x);
    }

    /// Range of each decision variable.
    pub fn range(&self, variable: usize) -> [f64; 2] {
        self.layout.range(variable / self.layout.knots())
    }

    /// Cost (2) at a parameter of the central path, 0 for the hard laws; infinite where the
    /// simulation fails. Takes one simulation.
    pub fn cost(&self, smoothing: f64, x: &[f64]) -> f64 {
        match self.readings(smoothing, x) {
            Ok(readings) => self.cost_of(&readings, x),
            Err(_) => f64::INFINITY,
        }
    }

    /// Largest distance from a goal under the hard laws, as a part of its scale.
    pub fn miss(&self, x: &[f64]) -> f64 {
        let Ok(readings) = self.readings(0.0, x) else {
            return f64::INFINITY;
        };
        let goals = self.targets.iter().zip(readings);
        let goals = goals.filter(|(target, _)| target.goal.is_some());
        goals
            .map(|(target, reading)| ((reading - target.value) / target.scale).abs())
            .fold(0.0, f64::max)
    }

    /// Value of every target in one simulation, SI.
    pub(crate) fn readings(
        &self,
        smoothing: f64,
        x: &[f64],
    ) -> std::result::Result<Vec<f64>, SimulationError> {
        self.readings_of(smoothing, &self.drive(x)?)
    }

    /// Value of every target under given commands, SI.
    pub(crate) fn readings_of(
        &self,
        smoothing: f64,
        drive: &InputTrajectory,
    ) -> std::result::Result<Vec<f64>, SimulationError> {
        self.counter.plain();
        let plant = self.plant_at(smoothing);
        let mut readings = vec![f64::NAN; self.targets.len()];
        plant.simulate_with(
            &self.values,
            &self.start,
            drive,
            &self.layout.t,
            |row, stepper| {
                for index in target::at_row(&self.targets, row) {
                    readings[index] = self.targets[index].quantity.plain(stepper);
                }
            },
        )?;
        Ok(readings)
    }

    /// The plant on the central path. There it only guides: its steps are longer, since its
    /// friction is stiff.
    pub(crate) fn plant_at(&self, smoothing: f64) -> Plant {
        let settings = self.plant.settings();
        let rate_step = if smoothing > 0.0 {
            settings.rate_step.max(GUIDING_STEP)
        } else {
            settings.rate_step
        };
        self.plant.with_settings(SimulationSettings {
            smoothing,
            rate_step,
            ..settings
        })
    }

    pub(crate) fn drive(&self, x: &[f64]) -> std::result::Result<InputTrajectory, SimulationError> {
        let commands = self.layout.commands(x);
        let columns: Vec<&[f64]> = commands.iter().map(Vec::as_slice).collect();
        InputTrajectory::new(&self.plant, self.layout.t.len(), &columns)
    }

    /// Cost of readings and variables.
    pub(crate) fn cost_of(&self, readings: &[f64], x: &[f64]) -> f64 {
        let squares = |residuals: Vec<f64>| residuals.iter().map(|r| r * r).sum::<f64>();
        let cost = squares(self.misses(readings)) + squares(self.efforts(x));
        if cost.is_finite() {
            cost
        } else {
            f64::INFINITY
        }
    }

    /// Residuals of the targets.
    pub(crate) fn misses(&self, readings: &[f64]) -> Vec<f64> {
        let pairs = self.targets.iter().zip(readings);
        pairs
            .map(|(target, reading)| target.weight * (reading - target.value))
            .collect()
    }

    /// Residuals of effort and change: `sqrt(W / K) x_k` and `sqrt(W / K) (x_k - x_(k-1))`.
    pub(crate) fn efforts(&self, x: &[f64]) -> Vec<f64> {
        let knots = self.layout.knots();
        let weight = self.effort_weight();
        let mut residuals = Vec::with_capacity(2 * x.len());
        for (input, x) in x.chunks(knots).enumerate() {
            let mut last = self.layout.origin(input);
            for &x in x {
                residuals.push(weight * x);
                residuals.push(weight * (x - last));
                last = x;
            }
        }
        residuals
    }

    /// Derivative of each residual of [`PlanProblem::efforts`] by its own variable.
    pub(crate) fn effort_weight(&self) -> f64 {
        (self.effort / self.variables() as f64).sqrt()
    }

    /// Variables that drive every input to its farther limit and, from the middle on, back.
    pub(crate) fn push(&self) -> Vec<f64> {
        let mut push = self.rest();
        let knots = self.layout.knots();
        for (input, x) in push.chunks_mut(knots).enumerate() {
            let [low, high] = self.layout.range(input);
            let far = if high >= -low { high } else { low };
            x[..knots.div_ceil(2)].fill(far);
        }
        self.project(&mut push);
        push
    }

    /// Scales of the targets: the distance from the value without any command, or a part of the
    /// range in a probe that drives every input to its limit and back.
    fn scale(&mut self) -> Result<()> {
        let rest = self.rest();
        let (idle, _) = self.run(&rest)?;
        let push = self.push();
        // A probe that diverges gives no range: the distances remain.
        let ranges = self.run(&push).map(|(_, ranges)| ranges);
        let ranges = ranges.unwrap_or_else(|_| vec![0.0; self.targets.len()]);
        let path: Vec<Quantity> = self.targets.iter().map(|target| target.quantity).collect();
        let distance = |index: usize| (self.targets[index].value - idle[index]).abs();
        let scales: Vec<f64> = (0..self.targets.len())
            .map(|index| {
                let of_path = |other: &usize| self.targets[*other].goal.is_none();
                let farthest = match self.targets[index].goal {
                    Some(_) => distance(index),
                    None => (0..path.len())
                        .filter(|other| path[*other] == path[index] && of_path(other))
                        .map(distance)
                        .fold(0.0, f64::max),
                };
                let fallback = PART_OF_RANGE * ranges[index];
                let found = [farthest, fallback].into_iter().find(|scale| *scale > 0.0);
                found.unwrap_or(1.0)
            })
            .collect();
        for (target, scale) in self.targets.iter_mut().zip(scales) {
            target.scale = scale;
            target.weight /= scale;
        }
        Ok(())
    }

    /// Readings of the targets, and the range of their quantities over the whole run.
    fn run(&self, x: &[f64]) -> std::result::Result<(Vec<f64>, Vec<f64>), SimulationError> {
        self.counter.plain();
        let drive = self.drive(x)?;
        let count = self.targets.len();
        let mut readings = vec![f64::NAN; count];
        let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; count];
        self.plant.simulate_with(
            &self.values,
            &self.start,
            &drive,
            &self.layout.t,
            |row, stepper| {
                for (index, target) in self.targets.iter().enumerate() {
                    let now = target.quantity.plain(stepper);
                    range[index] = [range[index][0].min(now), range[index][1].max(now)];
                    if target.row == row {
                        readings[index] = now;
                    }
                }
            },
        )?;
        let ranges = range.into_iter().map(|[low, high]| high - low);
        Ok((readings, ranges.collect()))
    }
}
