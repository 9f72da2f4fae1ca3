//! Static equilibrium under constant inputs (docs/explanation/plant.md, eq. 27 to 30).
//!
//! At a rest all velocities are zero and all forces balance. States of effects have decayed, lags
//! have arrived and HASEL actuators are charged. The search is Newton's method on the forces; a
//! contraction with a rate that is known beforehand replaces it where it fails.

mod balance;
mod contraction;
mod interval;
mod search;
mod symmetric;

use crate::dual::Dual;
use crate::error::{NoRest, SimulationError};
use crate::plant::Plant;
use crate::plant::topology::Topology;
use crate::scalar::Scalar;
use balance::Balance;
pub use contraction::Contraction;
pub use interval::{RestInterval, RestPoint};
use search::{Found, Search};

/// Columns of the stiffness that one evaluation of the forces gives.
const SEEDS: usize = 8;

/// Static equilibrium of a plant under constant inputs, without dry friction.
#[derive(Clone, Debug)]
pub struct Rest<S> {
    /// State, in the order of [`Plant::state_names`]; velocities are zero.
    pub state: Vec<S>,
    /// Signal of every sensor, SI.
    pub signals: Vec<S>,
    /// Tendons that are slack.
    pub slack: Vec<String>,
    /// End stops that are pressed, by body.
    pub pressed: Vec<String>,
    /// Steps of Newton's method, or of the contraction where that was needed.
    pub steps: usize,
    /// Evaluations of all forces; the stiffness of n bodies counts as n + 1.
    pub evaluations: usize,
    /// Rate and certified number of steps of the contraction, where bounds on the stiffness are
    /// known for every state. The rest is then the only one.
    pub contraction: Option<Contraction>,
    /// Newton's method failed and the contraction found the rest.
    pub fallback: bool,
}

/// Checked problem: constant inputs at a plant, and where the search starts.
struct Problem<'a> {
    plant: &'a Plant,
    values: Vec<f64>,
    inputs: Vec<f64>,
    start: Vec<f64>,
}

impl Plant {
    /// Body of [`Plant::rest`].
    pub(crate) fn find_rest<S: Scalar>(
        &self,
        values: &[S],
        inputs: &[S],
        start: &[f64],
    ) -> Result<Rest<S>, SimulationError> {
        let plain = |numbers: &[S]| numbers.iter().map(|x| x.value()).collect::<Vec<f64>>();
        let problem = Problem::new(self, plain(values), plain(inputs), start)?;
        let found = problem.solve(None)?;
        let topology = &*self.topology;
        let mut balance = Balance::new(topology, values, inputs, None);
        let varies = |numbers: &[S]| !numbers.iter().all(|x| x.is_constant());
        let q = if varies(values) || varies(inputs) {
            problem.lift(&found, &mut balance)
        } else {
            found.q.iter().map(|&q| S::constant(q)).collect()
        };
        let (state, signals) = balance.read(&q);
        let (slack, pressed) = balance.branch_names(self);
        Ok(Rest {
            state,
            signals,
            slack,
            pressed,
            steps: found.steps,
            evaluations: found.evaluations,
            contraction: found.contraction,
            fallback: found.fallback,
        })
    }
}

impl<'a> Problem<'a> {
    fn new(
        plant: &'a Plant,
        values: Vec<f64>,
        inputs: Vec<f64>,
        start: &[f64],
    ) -> Result<Self, SimulationError> {
        plant.expect("parameter values", plant.parameters().len(), values.len())?;
        plant.expect("inputs", plant.inputs().len(), inputs.len())?;
        plant.expect("start", plant.state_len(), start.len())?;
        let names = plant.parameters().iter().map(|parameter| &parameter.name);
        let parameters = values.iter().zip(names);
        let columns = (inputs.iter()).zip(plant.inputs().iter().map(|input| &input.column));
        for (value, name) in parameters.chain(columns) {
            if !value.is_finite() {
                let what = format!("`{name}`");
                return Err(SimulationError::NotFinite { what });
            }
        }
        let topology = &*plant.topology;
        if let Some(&body) = topology.imposed.first() {
            return Err(no_rest(topology, body, NoRest::Imposed));
        }
        let start = start[..topology.bodies.len()].to_vec();
        if let Some(body) = start.iter().position(|q| !q.is_finite()) {
            let what = format!("the start of `{}`", topology.names[body]);
            return Err(SimulationError::NotFinite { what });
        }
        Ok(Self {
            plant,
            values,
            inputs,
            start,
        })
    }

    /// Positions at which the forces balance, at an edge of the interval of rests if one is given.
    fn solve(&self, edge: Option<balance::Edge>) -> Result<Found, SimulationError> {
        let topology = &*self.plant.topology;
        let mut search = Search {
            topology,
            balance: Balance::new(topology, &self.values, &self.inputs, edge),
            slopes: self.slopes(edge),
        };
        search
            .run(&self.start, edge.is_none())
            .map_err(|(body, reason)| no_rest(topology, body, reason))
    }

    fn slopes(&self, edge: Option<balance::Edge>) -> Balance<'_, Dual<SEEDS>> {
        let constant = |numbers: &[f64]| numbers.iter().map(|&x| Dual::constant(x)).collect();
        let (values, inputs): (Vec<_>, Vec<_>) = (constant(&self.values), constant(&self.inputs));
        Balance::new(&self.plant.topology, &values, &inputs, edge)
    }

    /// One Newton step in numbers that carry derivatives: the values stay, the derivatives are
    /// those of the implicit function (eq. 30).
    fn lift<S: Scalar>(&self, found: &Found, balance: &mut Balance<'_, S>) -> Vec<S> {
        let at: Vec<S> = found.q.iter().map(|&q| S::constant(q)).collect();
        let force = balance.forces(&at);
        let stiffness = self.slopes(None).stiffness(&found.q);
        let compliance = symmetric::Decomposition::of(&stiffness, at.len()).inverse();
        let rows = compliance.chunks_exact(at.len());
        let moved = at.iter().zip(rows).map(|(&q, row)| {
            let mut step = S::ZERO;
            for (&compliance, &force) in row.iter().zip(&force) {
                step += force * compliance;
            }
            q + (step - step.value())
        });
        moved.collect()
    }
}

fn no_rest(topology: &Topology, body: usize, reason: NoRest) -> SimulationError {
    SimulationError::NoRest {
        at: topology.place(body),
        reason,
    }
}
