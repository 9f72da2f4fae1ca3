//! A plant with fixed parameter values, for many simulations that differ in initial state and
//! inputs.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::run::Trajectory;
use super::simulated::Simulated;
use crate::error::SimulationError;
use crate::input_trajectory::InputTrajectory;
use crate::integrator::Stepper;
use crate::integrator::exact::TransitionCache;
use crate::plant::Plant;

/// A plant with fixed parameter values.
///
/// Results that depend on the values and the sample interval alone are computed once for all
/// simulations, concurrent ones included: the transition matrix of a linear rig
/// (docs/explanation/plant.md, eq. 18b).
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_m'\n";
/// use sinew_sim::{InputTrajectory, Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let fixed = plant.parameterized(plant.values(), 0.1);
/// let inputs = InputTrajectory::new(&plant, 2, &[])?;
/// for velocity in [1.0, 2.0] {
///     let run = fixed.simulate(&[0.0, velocity], &inputs, &[0.0, 0.1])?;
///     assert!((run.signal(1, 0) - 0.1 * velocity).abs() < 1e-15);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ParameterizedPlant<'a, S> {
    plant: &'a Plant,
    values: Vec<S>,
    kept: Arc<TransitionCache<S>>,
}

impl<S> ParameterizedPlant<'_, S> {
    /// Value of every parameter slot.
    pub fn values(&self) -> &[S] {
        &self.values
    }
}

impl Plant {
    /// `values` has one entry a parameter slot; `interval` is the sample interval of most
    /// simulations, s.
    pub fn parameterized<S: Simulated>(
        &self,
        values: Vec<S>,
        interval: f64,
    ) -> ParameterizedPlant<'_, S> {
        ParameterizedPlant {
            plant: self,
            values,
            kept: Arc::new(TransitionCache::new(interval)),
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
