//! The initial state of a plant.

use super::simulated::Simulated;
use crate::error::SimulationError;
use crate::plant::Plant;

impl Plant {
    /// The state that a simulation starts from: a body with a position sensor starts at (its first
    /// valid sample - offset) / gain, others at 0, velocities 0; a body's `start` and
    /// `start_velocity` in the rig come first. A hidden mode starts with its host, a lagged reading
    /// at the reading, other internal states relaxed at 0. `first` has one entry a sensor, SI.
    ///
    /// # Errors
    /// [`SimulationError::Shape`].
    pub fn initial_state<S: Simulated>(
        &self,
        values: &[S],
        first: &[Option<f64>],
    ) -> Result<Vec<S>, SimulationError> {
        S::start(self, values, first)
    }
}
