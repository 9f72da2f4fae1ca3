//! Derivatives of the targets by the decision variables: forwards by dual numbers, or backwards by
//! the simulator's tape (docs/explanation/plant.md, eq. 20 to 22).

use nalgebra::DMatrix;
use rayon::prelude::*;
use sinew_sim::{Dual, SimulationError, Stepper};

use crate::count::{BACKWARD_COST, FORWARD_COST};
use crate::layout::Limits;
use crate::problem::PlanProblem;
use crate::quantity::Quantity;
use crate::target;

/// Derivatives that one forward pass carries.
const SEEDS: usize = 8;

type Result<T> = std::result::Result<T, SimulationError>;

/// Direction of a derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    /// A pass carries [`SEEDS`] variables: for few variables.
    Forward,
    /// A pass gives one target by all variables: for many variables and few targets.
    Backward,
}

impl PlanProblem {
    /// The cheaper direction. Only signals of sensors can be followed backwards.
    pub(crate) fn direction(&self) -> Direction {
        let forward = self.variables().div_ceil(SEEDS) * FORWARD_COST;
        let backward = self.targets.len() * BACKWARD_COST;
        let sensors = |quantity| matches!(quantity, Quantity::Sensor(_));
        let possible = self.targets.iter().all(|target| sensors(target.quantity));
        if possible && backward < forward {
            Direction::Backward
        } else {
            Direction::Forward
        }
    }

    /// Plain simulations that one Jacobian stands for.
    pub(crate) fn jacobian_cost(&self) -> usize {
        match self.direction() {
            Direction::Forward => self.variables().div_ceil(SEEDS) * FORWARD_COST,
            Direction::Backward => self.targets.len() * BACKWARD_COST,
        }
    }

    /// Derivative of each target's reading by each variable, SI.
    pub(crate) fn jacobian(
        &self,
        smoothing: f64,
        x: &[f64],
        direction: Direction,
    ) -> Result<DMatrix<f64>> {
        let columns: Vec<Vec<f64>> = match direction {
            Direction::Forward => {
                let firsts: Vec<usize> = (0..self.variables()).step_by(SEEDS).collect();
                let passes = firsts.into_par_iter();
                let passes: Vec<Vec<[f64; SEEDS]>> = passes
                    .map(|first| self.forward(smoothing, x, first))
                    .collect::<Result<_>>()?;
                let column = |k: usize| {
                    let rows = passes[k / SEEDS].iter();
                    rows.map(|seeds| seeds[k % SEEDS]).collect()
                };
                (0..self.variables()).map(column).collect()
            }
            Direction::Backward => {
                let rows: Vec<Vec<f64>> = (0..self.targets.len())
                    .into_par_iter()
                    .map(|target| self.backward(smoothing, x, target))
                    .collect::<Result<_>>()?;
                let column = |k: usize| rows.iter().map(|row| row[k]).collect();
                (0..self.variables()).map(column).collect()
            }
        };
        let shape = (self.targets.len(), self.variables());
        Ok(DMatrix::from_fn(shape.0, shape.1, |row, column| {
            columns[column][row]
        }))
    }

    /// Derivatives of every target by the variables from `first` on.
    fn forward(&self, smoothing: f64, x: &[f64], first: usize) -> Result<Vec<[f64; SEEDS]>> {
        self.counter.forward();
        let constant = |values: &[f64]| -> Vec<Dual<SEEDS>> {
            values.iter().map(|&value| lifted(value)).collect()
        };
        let commands = self.layout.commands(x);
        let shares = self.layout.shares();
        let knots = self.layout.knots();
        // A command is its plain value; its derivatives are those of the interpolation.
        let row_of = |row: usize| -> Vec<Dual<SEEDS>> {
            let (left, share) = shares[row];
            let command = |(input, limits): (usize, &Limits)| {
                let mut command: Dual<SEEDS> = lifted(commands[input][row]);
                for (knot, weight) in [(left, 1.0 - share), (left + 1, share)] {
                    let variable = knot.checked_sub(1).map(|free| input * knots + free);
                    let seed = variable.and_then(|variable| variable.checked_sub(first));
                    if let Some(seed) = seed.filter(|seed| *seed < SEEDS) {
                        command.derivative[seed] += limits.size * weight;
                    }
                }
                command
            };
            self.layout.limits.iter().enumerate().map(command).collect()
        };
        let plant = self.plant_at(smoothing);
        let mut stepper = Stepper::new(&plant, &constant(&self.values), &constant(&self.start))?;
        let mut found = vec![[0.0; SEEDS]; self.targets.len()];
        let mut now = row_of(0);
        stepper.hold(&now)?;
        for row in 1..self.layout.t.len() {
            let next = row_of(row);
            let seconds = self.layout.t[row] - self.layout.t[row - 1];
            stepper.advance_between(seconds, &now, &next)?;
            now = next;
            stepper.hold(&now)?;
            let mut at = target::at_row(&self.targets, row).peekable();
            if at.peek().is_none() {
                continue;
            }
            let state = stepper.state();
            for index in at {
                let quantity = self.targets[index].quantity;
                found[index] = quantity.read(|i| stepper.signal(i), &state).derivative;
            }
        }
        Ok(found)
    }

    /// Derivatives of one target by every variable; zero for a state, which no sensor reads.
    fn backward(&self, smoothing: f64, x: &[f64], index: usize) -> Result<Vec<f64>> {
        self.counter.backward();
        let target = &self.targets[index];
        let Quantity::Sensor(sensor) = target.quantity else {
            return Ok(vec![0.0; self.variables()]);
        };
        let drive = self.drive(x)?;
        let plant = self.plant_at(smoothing);
        let t = &self.layout.t;
        let gradient = plant.gradient(&self.values, &self.start, &drive, t, |run| {
            let mut seeds = vec![0.0; run.signals.len()];
            let here = target.row * run.sensors + sensor;
            seeds[here] = 1.0;
            (run.signals[here], seeds)
        })?;
        let knots = self.layout.knots();
        let mut found = vec![0.0; self.variables()];
        for (input, by_row) in gradient.inputs.iter().enumerate() {
            let size = self.layout.limits[input].size;
            for (&(left, share), slope) in self.layout.shares().iter().zip(by_row) {
                for (knot, weight) in [(left, 1.0 - share), (left + 1, share)] {
                    if let Some(free) = knot.checked_sub(1) {
                        found[input * knots + free] += size * weight * slope;
                    }
                }
            }
        }
        Ok(found)
    }
}

/// A number without derivatives.
fn lifted(value: f64) -> Dual<SEEDS> {
    Dual {
        value,
        derivative: [0.0; SEEDS],
    }
}
