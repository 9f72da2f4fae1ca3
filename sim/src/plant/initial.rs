//! Where a simulation starts.

use super::Plant;
use crate::error::SimulationError;
use crate::rig::Reads;
use crate::scalar::Scalar;

impl Plant {
    /// The state that a simulation starts from: a body with a position sensor starts at (its first
    /// valid sample - offset) / gain, others at 0, velocities 0; a body's `start` and
    /// `start_velocity` in the rig come first. `first` has one entry a sensor, SI.
    ///
    /// # Errors
    /// [`SimulationError::Shape`].
    pub fn initial_state<S: Scalar>(
        &self,
        values: &[S],
        first: &[Option<f64>],
    ) -> Result<Vec<S>, SimulationError> {
        self.expect("parameter values", self.parameters().len(), values.len())?;
        self.expect("first samples", self.sensors().len(), first.len())?;
        let bodies = &self.topology.bodies;
        let mut state = vec![S::ZERO; 2 * bodies.len()];
        for (body, slots) in bodies.iter().enumerate() {
            let seen =
                (self.topology.sensors.iter().zip(first)).find_map(|(sensor, sample)| {
                    match (sensor.reads, sample) {
                        (Reads::Position(read), Some(sample)) if read == body => Some(
                            (S::constant(*sample) - values[sensor.offset]) / values[sensor.gain],
                        ),
                        _ => None,
                    }
                });
            state[body] = match slots.start {
                Some(slot) => values[slot],
                None => seen.unwrap_or(S::ZERO),
            };
            if let Some(slot) = slots.start_velocity {
                state[bodies.len() + body] = values[slot];
            }
        }
        Ok(state)
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
