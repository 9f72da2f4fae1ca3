//! The initial state of a simulation.

use super::Plant;
use super::forces::{Point, State};
use super::input_signal::InputSignal;
use crate::error::SimulationError;
use crate::rig::Reads;
use crate::scalar::Scalar;

impl Plant {
    pub(crate) fn start<S: Scalar>(
        &self,
        values: &[S],
        first: &[Option<f64>],
    ) -> Result<Vec<S>, SimulationError> {
        self.expect("parameter values", self.parameters().len(), values.len())?;
        self.expect("first samples", self.sensors().len(), first.len())?;
        let topology = &*self.topology;
        let bodies = topology.bodies.len();
        let mut state = State::rest(topology);
        for (body, slots) in topology.bodies.iter().enumerate() {
            if let Some(host) = slots.host {
                state.q[body] = state.q[host];
                state.v[body] = state.v[host];
                continue;
            }
            let seen = (topology.sensors.iter().zip(first)).find_map(|(sensor, sample)| {
                match (sensor.reads, sample) {
                    (Reads::Position(read), Some(sample)) if read == body => {
                        Some((S::constant(*sample) - values[sensor.offset]) / values[sensor.gain])
                    }
                    _ => None,
                }
            });
            state.q[body] = match slots.start {
                Some(slot) => values[slot],
                None => seen.unwrap_or(S::ZERO),
            };
            if let Some(slot) = slots.start_velocity {
                state.v[body] = values[slot];
            }
        }
        let complete = match topology.lagging[..] {
            [] => Vec::new(),
            _ => topology.shapes.complete(values),
        };
        for &sensor in &topology.lagging {
            let branches = vec![1; topology.switches.len()];
            let input_signals = vec![InputSignal::ZERO; topology.lines.len()];
            let at = Point {
                values: &complete,
                state: &state,
                input_signals: &input_signals,
                tau: S::ZERO,
                branches: &branches,
                motions: &[],
                smoothing: 0.0,
            };
            let reading = topology.reading(sensor, &at);
            if let Some((_, lag)) = topology.sensors[sensor].lag {
                state.z[lag] = reading;
            }
        }
        Ok([&state.q[..bodies], &state.v[..bodies], &state.z].concat())
    }

    pub(crate) fn expect(
        &self,
        what: &str,
        expected: usize,
        found: usize,
    ) -> Result<(), SimulationError> {
        if expected == found {
            return Ok(());
        }
        Err(SimulationError::Shape {
            what: what.to_owned(),
            expected,
            found,
        })
    }
}
