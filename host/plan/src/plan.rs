//! A plan: commands, and what the hard laws make of them.

use std::path::Path;

use serde_json::{Value, json};
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::{Column, Recording};
use sinew_ident::report::significant;
use sinew_sim::{InputTrajectory, Plant, Trajectory};

use crate::central_path::Level;
use crate::count::Count;
use crate::goal::Goal;
use crate::options::Options;
use crate::problem::PlanProblem;
use crate::search::{Search, search};

/// Format of [`Plan::json`].
pub const FORMAT: &str = "sinew-plan/1";

/// Runs that bring the start in agreement with the first row that the file will have.
const STARTS: usize = 2;

/// A goal and what became of it under the hard laws.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalOutcome {
    /// The goal.
    pub goal: Goal,
    /// Time of the row that is judged, s.
    pub time_s: f64,
    /// Value reached, in the unit of the goal.
    pub reached: f64,
    /// Miss as a part of the distance to go.
    pub part: f64,
    /// Unit of the value; empty where none is known.
    pub unit: String,
}

/// Commands from the start, and the simulation under the hard laws.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Time of each row, s.
    pub t: Vec<f64>,
    /// Commands, SI, one column an input: the very numbers that the written file gives.
    pub inputs: Vec<Vec<f64>>,
    /// The same in the columns' own units.
    written: Vec<Vec<f64>>,
    /// The plant under these commands.
    pub trajectory: Trajectory<f64>,
    /// One entry a goal.
    pub outcomes: Vec<GoalOutcome>,
    /// Root mean square of the distance from the path, as a part of its own scale.
    pub path_rms: Option<f64>,
    /// Cost under the hard laws.
    pub cost: f64,
    /// Part of the cost that effort and change make.
    pub effort: f64,
    /// Part of the rows at which some input is at a limit or a rate limit.
    pub at_limits: f64,
    /// Levels of the central path.
    pub levels: Vec<Level>,
    /// Simulations.
    pub count: Count,
}

/// Plans open-loop commands from the plant's start. `file` is the rig's, for errors; `progress`
/// hears of each level of the central path.
///
/// # Errors
/// As [`PlanProblem::new`]; `Simulation` where the rig cannot be simulated.
pub fn plan(
    plant: &Plant,
    file: &Path,
    goals: &[Goal],
    path: Option<&Recording>,
    options: &Options,
    progress: &mut dyn FnMut(&Level),
) -> Result<Plan> {
    let problem = PlanProblem::new(plant, file, goals, path, options)?;
    let search_options = Options {
        simulations: options.simulations.saturating_sub(STARTS + 1),
        ..options.clone()
    };
    let found = search(&problem, &search_options, Search::CentralPath, progress);
    Plan::judged(&problem, plant, goals, &found.x, found.levels)
}

impl Plan {
    /// Simulates commands as their file gives them, under the hard laws.
    fn judged(
        problem: &PlanProblem,
        plant: &Plant,
        goals: &[Goal],
        x: &[f64],
        levels: Vec<Level>,
    ) -> Result<Self> {
        let t = problem.layout.t.clone();
        let commands = problem.layout.commands(x);
        let written: Vec<Vec<f64>> = (plant.inputs().iter().zip(commands))
            .map(|(input, column)| {
                let factor = input.column_factor;
                column.into_iter().map(|u| u / factor).collect()
            })
            .collect();
        let inputs: Vec<Vec<f64>> = (plant.inputs().iter().zip(&written))
            .map(|(input, column)| column.iter().map(|u| u * input.column_factor).collect())
            .collect();
        let columns: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let mut first = vec![vec![f64::NAN; t.len()]; plant.sensors().len()];
        let mut run = None;
        for _ in 0..STARTS {
            let signals: Vec<&[f64]> = first.iter().map(Vec::as_slice).collect();
            problem.counter.plain();
            let simulated = plant.simulate_recording(&t, &columns, &signals)?;
            for (index, sensor) in plant.sensors().iter().enumerate() {
                let factor = sensor.column_factor;
                first[index][0] = simulated.trajectory.signal(0, index) / factor * factor;
            }
            run = Some(simulated);
        }
        let run = run.ok_or_else(|| Error::failed("the plan was not simulated"))?;
        let drive = InputTrajectory::new(plant, t.len(), &columns)?;
        let readings = problem.readings_of(0.0, &drive)?;
        let cost = problem.cost_of(&readings, x);
        let outcomes = problem.targets.iter().zip(&readings);
        let outcomes = outcomes.filter_map(|(target, &reading)| {
            let goal = &goals[target.goal?];
            Some(GoalOutcome {
                goal: goal.clone(),
                time_s: t[target.row],
                reached: reading / target.quantity.factor(plant),
                part: ((reading - target.value) / target.scale).abs(),
                unit: target.quantity.unit(plant),
            })
        });
        let along = problem.targets.iter().zip(&readings);
        let along: Vec<f64> = along
            .filter(|(target, _)| target.goal.is_none())
            .map(|(target, reading)| ((reading - target.value) / target.scale).powi(2))
            .collect();
        let mean = along.iter().sum::<f64>() / along.len().max(1) as f64;
        Ok(Self {
            outcomes: outcomes.collect(),
            path_rms: (!along.is_empty()).then_some(mean.sqrt()),
            cost,
            effort: problem.efforts(x).iter().map(|r| r * r).sum(),
            at_limits: at_limits(problem, &inputs),
            trajectory: run.trajectory,
            levels,
            count: problem.count(),
            written,
            inputs,
            t,
        })
    }

    /// Refuses a plan that misses a goal or its path by more than `tolerance`, a part of the
    /// distance to go.
    ///
    /// # Errors
    /// `Failed`, with the largest miss and how long commands were at their limits.
    pub fn reached(&self, tolerance: f64) -> Result<()> {
        let limits = format!("{:.0} % of the time", 100.0 * self.at_limits);
        let help = format!(
            "an input is at a limit {limits}; wider limits, more time (a later goal), more \
             --simulations, or a larger --tolerance"
        );
        let worst = self
            .outcomes
            .iter()
            .max_by(|a, b| a.part.total_cmp(&b.part));
        if let Some(worst) = worst.filter(|worst| worst.part > tolerance) {
            let unit = match worst.unit.as_str() {
                "" => String::new(),
                unit => format!(" {unit}"),
            };
            let miss = significant((worst.reached - worst.goal.value).abs(), 3);
            let (goal, reached) = (&worst.goal, significant(worst.reached, 4));
            let message =
                format!("the goal `{goal}` is missed by {miss}{unit}: {reached}{unit} is reached");
            return Err(Error::failed(message).help(help));
        }
        match self.path_rms.filter(|rms| *rms > tolerance) {
            Some(rms) => {
                let part = significant(100.0 * rms, 3);
                let message = format!("the path is missed by {part} % of its length (RMS)");
                Err(Error::failed(message).help(help))
            }
            None => Ok(()),
        }
    }

    /// The plan as a recording: commands, then every sensor, in the columns' own units.
    ///
    /// # Errors
    /// None beyond what [`Recording::new`] refuses.
    pub fn recording(&self, plant: &Plant, path: impl AsRef<Path>) -> Result<Recording> {
        let column = |name: &str, factor: f64, values: Vec<f64>| Column {
            name: name.to_owned(),
            values: values.into_iter().map(|value| value / factor).collect(),
        };
        let inputs = plant.inputs().iter().zip(&self.written);
        let inputs = inputs.map(|(input, values)| column(&input.column, 1.0, values.clone()));
        let sensors = plant.sensors().iter().enumerate();
        let sensors =
            sensors.map(|(k, s)| column(&s.column, s.column_factor, self.trajectory.column(k)));
        Recording::new(path, self.t.clone(), inputs.chain(sensors).collect())
    }

    /// The plan for programs (`sinew-plan/1`).
    pub fn json(&self, plant: &Plant, options: &Options) -> Value {
        let inputs = plant.inputs().iter().map(|input| input.column.as_str());
        let outcomes = self.outcomes.iter().map(|outcome| {
            json!({
                "quantity": outcome.goal.name,
                "wanted": outcome.goal.value,
                "time_s": outcome.time_s,
                "reached": outcome.reached,
                "miss": outcome.reached - outcome.goal.value,
                "miss_part": outcome.part,
                "unit": outcome.unit,
            })
        });
        let levels = self.levels.iter().map(|level| {
            json!({
                "smoothing": level.smoothing,
                "cost": finite(level.cost),
                "hard_cost": finite(level.hard_cost),
            })
        });
        json!({
            "format": FORMAT,
            "rows": self.t.len(),
            "duration_s": self.t.last(),
            "inputs": inputs.collect::<Vec<_>>(),
            "goals": outcomes.collect::<Vec<_>>(),
            "path_rms_part": self.path_rms,
            "tolerance": options.tolerance,
            "reached": self.reached(options.tolerance).is_ok(),
            "cost": finite(self.cost),
            "effort_cost": self.effort,
            "at_limits": self.at_limits,
            "seed": options.seed,
            "simulations": {
                "plain": self.count.plain,
                "forward": self.count.forward,
                "backward": self.count.backward,
                "equivalent": self.count.equivalent(),
            },
            "levels": levels.collect::<Vec<_>>(),
        })
    }
}

/// A number that JSON can hold; null for a simulation that failed.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Part of the rows at which some input is within a ten-thousandth of a limit or its rate limit.
fn at_limits(problem: &PlanProblem, inputs: &[Vec<f64>]) -> f64 {
    const NEAR: f64 = 1e-4;
    let t = &problem.layout.t;
    let at = |row: &usize| {
        let columns = problem.layout.limits.iter().zip(inputs);
        columns.into_iter().any(|(limits, u)| {
            let (now, range) = (u[*row], limits.high - limits.low);
            let change = limits.rate * (t[*row] - t[row - 1]);
            let edge = (now - limits.low).min(limits.high - now) <= NEAR * range;
            // A limit at which a rig rests is no effort.
            (edge && now != limits.start) || (now - u[row - 1]).abs() >= change * (1.0 - NEAR)
        })
    };
    let rows = 1..t.len();
    rows.clone().filter(at).count() as f64 / rows.len() as f64
}
