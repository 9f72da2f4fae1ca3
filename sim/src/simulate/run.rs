//! Whole recordings: a plant driven by columns, its signals at the recorded times.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::simulated::Simulated;
use crate::error::SimulationError;
use crate::input_trajectory::InputTrajectory;
use crate::integrator::Stepper;
use crate::integrator::exact::TransitionCache;
use crate::plant::Plant;
use crate::scalar::Scalar;
use crate::settings::IntegrationReport;

/// Result of a simulation.
#[derive(Clone, Debug)]
pub struct Trajectory<S> {
    /// Every sensor's signal at every time, SI: row-major, one row a time.
    pub signals: Vec<S>,
    /// Sensors a row.
    pub sensors: usize,
    /// The state at the last time.
    pub final_state: Vec<S>,
    /// Report of the integrator.
    pub report: IntegrationReport,
}

impl<S: Copy> Trajectory<S> {
    /// One signal at one time.
    ///
    /// # Panics
    /// When the row or the sensor is not there.
    pub fn signal(&self, row: usize, sensor: usize) -> S {
        self.signals[row * self.sensors + sensor]
    }

    /// One sensor's signal over time.
    ///
    /// # Panics
    /// When the sensor is not there.
    pub fn column(&self, sensor: usize) -> Vec<S> {
        assert!(sensor < self.sensors, "the plant has no sensor {sensor}");
        self.signals
            .iter()
            .skip(sensor)
            .step_by(self.sensors)
            .copied()
            .collect()
    }
}

/// A simulation as `sinew simulate` runs it, with what was filled in.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::{Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let (force, position) = ([4.0, f64::NAN, 0.0], [0.0, 0.01, 0.03]);
/// let run = plant.simulate_recording(&[0.0, 0.1, 0.2], &[&force], &[&position])?;
/// assert_eq!(run.held, [1], "one sample of the force is missing");
/// assert_eq!(run.start, [0.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RecordingRun {
    /// The signals, SI.
    pub trajectory: Trajectory<f64>,
    /// Initial state.
    pub start: Vec<f64>,
    /// Missing samples of each input, which held their last value.
    pub held: Vec<usize>,
}

impl<S: Scalar> Trajectory<S> {
    pub(super) fn ended(signals: Vec<S>, sensors: usize, stepper: &Stepper<S>) -> Self {
        Self {
            signals,
            sensors,
            final_state: stepper.state(),
            report: stepper.report(),
        }
    }
}

impl Plant {
    /// Simulates the recorded times; row 0 is `start` itself.
    ///
    /// `values` has one entry a parameter slot, `start` one a state ([`Plant::state_names`]),
    /// `drive` one row a time. Cost: 4 force evaluations a sub-step, about 0.2 us for one body.
    ///
    /// # Errors
    /// Any [`SimulationError`] but `NoInput`.
    pub fn simulate<S: Simulated>(
        &self,
        values: &[S],
        start: &[S],
        drive: &InputTrajectory,
        times: &[f64],
    ) -> Result<Trajectory<S>, SimulationError> {
        let sensors = self.sensors().len();
        let mut signals = Vec::with_capacity(sensors * times.len());
        let stepper = self.simulate_with(values, start, drive, times, |_, stepper| {
            stepper.read(&mut signals);
        })?;
        Ok(Trajectory::ended(signals, sensors, &stepper))
    }

    /// As [`Plant::simulate`], and `visit` sees the plant at every row: signals, states, forces.
    ///
    /// # Errors
    /// As [`Plant::simulate`].
    pub fn simulate_with<S: Simulated>(
        &self,
        values: &[S],
        start: &[S],
        drive: &InputTrajectory,
        times: &[f64],
        mut visit: impl FnMut(usize, &Stepper<S>),
    ) -> Result<Stepper<S>, SimulationError> {
        self.simulate_until(values, start, drive, times, |row, stepper| {
            visit(row, stepper);
            ControlFlow::Continue(())
        })
    }

    /// As [`Plant::simulate_with`], no further than the row at which `visit` breaks off.
    ///
    /// # Errors
    /// As [`Plant::simulate`].
    pub fn simulate_until<S: Simulated>(
        &self,
        values: &[S],
        start: &[S],
        drive: &InputTrajectory,
        times: &[f64],
        mut visit: impl FnMut(usize, &Stepper<S>) -> ControlFlow<()>,
    ) -> Result<Stepper<S>, SimulationError> {
        S::run(self, [values, start], None, drive, times, &mut visit)
    }

    pub(crate) fn run<S: Scalar>(
        &self,
        [values, start]: [&[S]; 2],
        kept: Option<&Arc<TransitionCache<S>>>,
        drive: &InputTrajectory,
        times: &[f64],
        visit: &mut dyn FnMut(usize, &Stepper<S>) -> ControlFlow<()>,
    ) -> Result<Stepper<S>, SimulationError> {
        self.expect("rows of the drive", times.len(), drive.rows())?;
        let increases = |pair: &[f64]| pair[0] < pair[1] && (pair[1] - pair[0]).is_finite();
        if let Some(row) = times.windows(2).position(|pair| !increases(pair)) {
            return Err(SimulationError::Time { row: row + 1 });
        }
        let mut stepper = Stepper::begin(self, values, start)?;
        stepper.replay_history(drive);
        if let Some(kept) = kept {
            stepper.share(Arc::clone(kept));
        }
        let origin = times.first().copied().unwrap_or(0.0);
        for row in 0..times.len() {
            if row > 0 {
                stepper
                    .step(times[row] - times[row - 1])
                    .map_err(|error| match error {
                        SimulationError::Diverged { at, time } => SimulationError::Diverged {
                            at,
                            time: origin + time,
                        },
                        other => other,
                    })?;
            }
            let ahead = (row + 1 < times.len()).then(|| times[row + 1] - times[row]);
            stepper.set_inputs(drive, row, ahead);
            if visit(row, &stepper).is_break() {
                break;
            }
        }
        Ok(stepper)
    }

    /// Drives the rig as it is written with a recording's columns (`sinew simulate`): one entry an
    /// input and one a sensor, in the plant's order, SI, NaN where a sample is missing. A column
    /// that imposes a motion is given as recorded, once an input ([`Plant::derive_motions`]).
    ///
    /// # Errors
    /// Any [`SimulationError`].
    pub fn simulate_recording(
        &self,
        times: &[f64],
        inputs: &[&[f64]],
        signals: &[&[f64]],
    ) -> Result<RecordingRun, SimulationError> {
        let mut columns: Vec<Vec<f64>> = inputs.iter().map(|column| column.to_vec()).collect();
        self.derive_motions(times, &mut columns)?;
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let drive = InputTrajectory::new(self, times.len(), &columns)?;
        let first: Vec<Option<f64>> = signals
            .iter()
            .map(|column| column.iter().copied().find(|sample| sample.is_finite()))
            .collect();
        let values = self.values();
        let start = self.initial_state(&values, &first)?;
        let trajectory = self.simulate(&values, &start, &drive, times)?;
        Ok(RecordingRun {
            trajectory,
            start,
            held: drive.held().to_vec(),
        })
    }
}
