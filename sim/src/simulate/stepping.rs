//! Stepping a plant sample by sample.

use super::simulated::Simulated;
use crate::error::SimulationError;
use crate::integrator::Stepper;
use crate::plant::Plant;

impl<S: Simulated> Stepper<S> {
    /// A plant at its start, inputs zero. `values` has one entry a parameter slot, `start` one a
    /// state ([`Plant::state_names`]).
    ///
    /// # Errors
    /// `Shape`, `NotFinite`, or `Inertia` for a body whose inertia is not positive.
    pub fn new(plant: &Plant, values: &[S], start: &[S]) -> Result<Self, SimulationError> {
        S::begin(plant, values, start)
    }

    /// Moves the plant to another state; time and inputs stay.
    ///
    /// # Errors
    /// `Shape`.
    pub fn set_state(&mut self, state: &[S]) -> Result<(), SimulationError> {
        S::place(self, state)
    }

    /// Advances by `dt` seconds with these inputs, one a column ([`Plant::inputs`]), SI, held.
    ///
    /// # Errors
    /// `Shape`, `NotFinite` for an input or `dt`, `TooStiff`, `Diverged`.
    pub fn advance(&mut self, dt: f64, input: &[S]) -> Result<(), SimulationError> {
        S::pass(self, dt, [input, input])
    }

    /// Advances by `dt` seconds; an actuator that holds linearly goes from the first inputs to the
    /// second, others hold the first.
    ///
    /// # Errors
    /// As [`Stepper::advance`].
    pub fn advance_between(
        &mut self,
        dt: f64,
        from: &[S],
        to: &[S],
    ) -> Result<(), SimulationError> {
        S::pass(self, dt, [from, to])
    }

    /// Takes inputs, one a column ([`Plant::inputs`]), SI, without time going on: for signals that
    /// depend on them.
    ///
    /// # Errors
    /// `Shape`.
    pub fn hold(&mut self, inputs: &[S]) -> Result<(), SimulationError> {
        if inputs.len() != self.topology.inputs {
            return Err(SimulationError::Shape {
                what: "inputs".to_owned(),
                expected: self.topology.inputs,
                found: inputs.len(),
            });
        }
        for (input, &value) in inputs.iter().enumerate() {
            self.take(input, value, S::ZERO);
        }
        self.present();
        Ok(())
    }

    /// The signal of a sensor now, SI.
    ///
    /// # Panics
    /// When the plant has no such sensor.
    pub fn signal(&self, sensor: usize) -> S {
        S::signal(self, sensor)
    }

    /// Every sensor's signal now, SI.
    pub fn signals(&self) -> Vec<S> {
        let mut signals = Vec::with_capacity(self.topology.sensors.len());
        self.read(&mut signals);
        signals
    }

    /// Adds every sensor's signal now, SI, to `out`.
    pub fn read(&self, out: &mut Vec<S>) {
        S::signals(self, out);
    }
}
