//! A plant with numbers in its slots, for many simulations that differ in where they start and what drives them.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::run::Trajectory;
use super::simulated::Simulated;
use crate::error::SimulationError;
use crate::input_trajectory::InputTrajectory;
use crate::integrator::Stepper;
use crate::integrator::exact::Kept;
use crate::plant::Plant;

/// What depends on nothing but the numbers and the sample interval is found once for all simulations (the matrix of a
/// linear rig, docs/explanation/plant.md, eq. 18b), also for those that run at the same time.
#[derive(Debug)]
pub struct ParameterizedPlant<'a, S> {
    plant: &'a Plant,
    values: Vec<S>,
    kept: Arc<Kept<S>>,
}

impl Plant {
    /// `values` has one entry a parameter slot; `interval` is the sample interval of most simulations, s.
    pub fn parameterized<S: Simulated>(
        &self,
        values: Vec<S>,
        interval: f64,
    ) -> ParameterizedPlant<'_, S> {
        ParameterizedPlant {
            plant: self,
            values,
            kept: Arc::new(Kept::new(interval)),
        }
    }
}

impl<S: Simulated> ParameterizedPlant<'_, S> {
    /// As [`Plant::simulate_until`].
    ///
    /// # Errors
    /// As [`Plant::simulate`].
    pub fn simulate_until(
        &self,
        start: &[S],
        drive: &InputTrajectory,
        times: &[f64],
        mut visit: impl FnMut(usize, &Stepper<S>) -> ControlFlow<()>,
    ) -> Result<Stepper<S>, SimulationError> {
        let unknowns = [&self.values[..], start];
        S::run(
            self.plant,
            unknowns,
            Some(&self.kept),
            drive,
            times,
            &mut visit,
        )
    }

    /// As [`Plant::simulate`].
    ///
    /// # Errors
    /// As [`Plant::simulate`].
    pub fn simulate(
        &self,
        start: &[S],
        drive: &InputTrajectory,
        times: &[f64],
    ) -> Result<Trajectory<S>, SimulationError> {
        let sensors = self.plant.sensors().len();
        let mut signals = Vec::with_capacity(sensors * times.len());
        let stepper = self.simulate_until(start, drive, times, |_, stepper| {
            stepper.read(&mut signals);
            ControlFlow::Continue(())
        })?;
        Ok(Trajectory::ended(signals, sensors, &stepper))
    }
}
