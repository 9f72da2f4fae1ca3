//! Interval of rests that dry friction, hysteresis and play leave.

use super::Problem;
use super::balance::{Balance, Edge, saturation};
use crate::error::SimulationError;
use crate::plant::Plant;
use crate::plant::topology::Memory;

/// State and signals at one end of an interval of rests.
#[derive(Clone, Debug, PartialEq)]
pub struct RestPoint {
    /// State, in the order of [`Plant::state_names`].
    pub state: Vec<f64>,
    /// Signal of every sensor, SI.
    pub signals: Vec<f64>,
}

/// Rests that one component with memory leaves: dry friction, a Bouc-Wen spring, the play of an
/// actuator. Others stay at their middle.
#[derive(Clone, Debug, PartialEq)]
pub struct RestInterval {
    /// The component: `carriage.coulomb_friction`.
    pub component: String,
    /// Force that it can hold at the rest, forward and backward, N or N m; of a play, half its
    /// width in both directions, in the unit of the input.
    pub hold: [f64; 2],
    /// Rests where the component pushes backward, then forward, with all that it has; `None` where
    /// nothing balances that.
    pub ends: [Option<RestPoint>; 2],
}

impl Plant {
    /// Body of [`Plant::rest_intervals`].
    pub(crate) fn find_rest_intervals(
        &self,
        values: &[f64],
        inputs: &[f64],
        state: &[f64],
    ) -> Result<Vec<RestInterval>, SimulationError> {
        let problem = Problem::new(self, values.to_vec(), inputs.to_vec(), state)?;
        let topology = &*self.topology;
        let mut intervals = Vec::new();
        for (index, friction) in topology.frictions.iter().enumerate() {
            let slot = (friction.laws.first().map(|law| law.slot))
                .or(friction.follows.first().map(|follow| follow.coefficient))
                .or(friction.warming.first().map(|warming| warming.slot));
            let Some(slot) = slot else { continue };
            let mut balance = Balance::new(topology, values, inputs, None);
            balance.forces(&problem.start);
            let hold = balance.hold(index);
            let edge = |direction| Edge::Friction { index, direction };
            if hold[0] + hold[1] > 0.0 {
                intervals.push(problem.interval(slot, hold, edge)?);
            }
        }
        for spring in &topology.springs {
            for memory in &spring.memory {
                let (slot, state, largest) = match *memory {
                    Memory::Hysteresis { slot, state, .. } => {
                        (slot, state, saturation(&values[slot..]))
                    }
                    Memory::Plastic { slot, state, .. } => (slot, state, values[slot + 1]),
                    Memory::Creep { .. } => continue,
                };
                let most = values[slot] * largest;
                let edge = |direction: f64| Edge::Saturated {
                    state,
                    value: direction * largest,
                };
                if most.is_finite() && most > 0.0 {
                    intervals.push(problem.interval(slot, [most; 2], edge)?);
                }
            }
        }
        for friction in &topology.presliding {
            let level = values[friction.slot];
            let edge = |direction| Edge::Saturated {
                state: friction.state,
                value: direction,
            };
            if level > 0.0 {
                intervals.push(problem.interval(friction.slot, [level; 2], edge)?);
            }
        }
        for (line, described) in topology.lines.iter().enumerate() {
            let Some(slot) = described.chain.play else {
                continue;
            };
            let half = 0.5 * values[slot];
            let edge = |direction: f64| Edge::Play {
                line,
                slot,
                direction: -direction,
            };
            if half > 0.0 {
                intervals.push(problem.interval(slot, [half; 2], edge)?);
            }
        }
        Ok(intervals)
    }
}

impl Problem<'_> {
    fn interval(
        &self,
        slot: usize,
        hold: [f64; 2],
        edge: impl Fn(f64) -> Edge,
    ) -> Result<RestInterval, SimulationError> {
        let mut ends = [None, None];
        for (end, direction) in ends.iter_mut().zip([1.0, -1.0]) {
            *end = match self.solve(Some(edge(direction))) {
                Ok(found) => Some(self.point(&found.q, edge(direction))),
                Err(SimulationError::NoRest { .. }) => None,
                Err(error) => return Err(error),
            };
        }
        Ok(RestInterval {
            component: self.plant.owner(slot),
            hold,
            ends,
        })
    }

    fn point(&self, q: &[f64], edge: Edge) -> RestPoint {
        let topology = &self.plant.topology;
        let mut balance = Balance::new(topology, &self.values, &self.inputs, Some(edge));
        let (state, signals) = balance.read(q);
        RestPoint { state, signals }
    }
}
