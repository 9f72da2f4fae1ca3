//! A plant in time: state, inputs, and the step from one sample to the next.

use super::substep::Substep;
use super::{Report, rate};
use crate::drive::Drive;
use crate::error::SimulationError;
use crate::plant::Plant;
use crate::plant::topology::Topology;
use crate::scalar::Scalar;
use std::sync::Arc;

/// A plant that is stepped sample by sample: what a controller is tested against.
///
/// It owns what it needs (the topology is shared with its [`Plant`]) and allocates only when made.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.velocity'\nsignal='v_m_s'\n";
/// use sinew_sim::{Plant, Rig, Stepper};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let mut stepper = Stepper::new(&plant, &plant.values(), &[0.0, 0.0])?;
/// stepper.advance(0.5, &[4.0])?; // 4 N for 0.5 s on 2 kg
/// assert_eq!(stepper.signal(0), 1.0);
/// assert!(stepper.advance(-0.5, &[4.0]).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stepper<S> {
    topology: Arc<Topology>,
    work: Substep<S>,
    report: Report,
    rate: (f64, usize),
    time: f64,
    /// Where in the sample interval the inputs are being read.
    tau: f64,
}

impl<S: Scalar> Stepper<S> {
    /// A plant at its start, inputs zero. `values` has one entry a parameter slot, `start` one a state
    /// ([`Plant::state_names`]).
    ///
    /// # Errors
    /// `Shape`, `NotFinite`, or `Inertia` for a body whose inertia is not positive.
    pub fn new(plant: &Plant, values: &[S], start: &[S]) -> Result<Self, SimulationError> {
        plant.expect("parameter values", plant.parameters().len(), values.len())?;
        plant.expect("start", plant.state_len(), start.len())?;
        for (value, parameter) in values.iter().zip(plant.parameters()) {
            if !value.value().is_finite() {
                return Err(SimulationError::NotFinite {
                    what: format!("parameter `{}`", parameter.name),
                });
            }
        }
        for (value, name) in start.iter().zip(plant.state_names()) {
            if !value.value().is_finite() {
                return Err(SimulationError::NotFinite {
                    what: format!("the start of `{name}`"),
                });
            }
        }
        let topology = Arc::clone(&plant.topology);
        for (body, name) in topology.bodies.iter().zip(&topology.names) {
            let inertia = values[body.inertia].value();
            if inertia <= 0.0 {
                return Err(SimulationError::Inertia {
                    body: name.clone(),
                    value: inertia,
                });
            }
        }
        let mut stepper = Self {
            work: Substep::new(&topology, values),
            topology,
            report: Report::default(),
            rate: (0.0, 0),
            time: 0.0,
            tau: 0.0,
        };
        stepper.set_state(start)?;
        stepper.watch_rate(0.0);
        Ok(stepper)
    }

    /// Moves the plant to another state; time and inputs stay.
    ///
    /// # Errors
    /// `Shape`.
    pub fn set_state(&mut self, state: &[S]) -> Result<(), SimulationError> {
        let bodies = self.topology.bodies.len();
        if state.len() != 2 * bodies {
            return Err(SimulationError::Shape {
                what: "state".to_owned(),
                expected: 2 * bodies,
                found: state.len(),
            });
        }
        self.work.state.q[..bodies].copy_from_slice(&state[..bodies]);
        self.work.state.v[..bodies].copy_from_slice(&state[bodies..]);
        Ok(())
    }

    /// Advances by `dt` seconds with these inputs, one a column ([`Plant::inputs`]), SI, held.
    ///
    /// # Errors
    /// `Shape`, `NotFinite` for an input or `dt`, `TooStiff`, `Diverged`.
    pub fn advance(&mut self, dt: f64, input: &[S]) -> Result<(), SimulationError> {
        self.advance_between(dt, input, input)
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
        for input in [from, to] {
            if input.len() != self.topology.inputs {
                return Err(SimulationError::Shape {
                    what: "inputs".to_owned(),
                    expected: self.topology.inputs,
                    found: input.len(),
                });
            }
            if !input.iter().all(|u| u.value().is_finite()) {
                return Err(SimulationError::NotFinite {
                    what: "an input".to_owned(),
                });
            }
        }
        if !(dt.is_finite() && dt > 0.0) {
            return Err(SimulationError::NotFinite {
                what: format!("the inverse of the step {dt} s"),
            });
        }
        for (index, (&from, &to)) in from.iter().zip(to).enumerate() {
            self.work.inputs.held[index] = from;
            self.work.inputs.slope[index] = (to - from) / dt;
        }
        self.step(dt)
    }

    /// The signal of a sensor now, SI.
    ///
    /// # Panics
    /// When the plant has no such sensor.
    #[inline]
    pub fn signal(&self, sensor: usize) -> S {
        self.topology.signal(
            sensor,
            &self.work.dynamics.values,
            &self.work.state,
            &self.work.inputs,
            S::constant(self.tau),
        )
    }

    /// Every sensor's signal now, SI.
    pub fn signals(&self) -> Vec<S> {
        (0..self.topology.sensors.len())
            .map(|sensor| self.signal(sensor))
            .collect()
    }

    /// Positions, then velocities.
    pub fn state(&self) -> Vec<S> {
        let bodies = self.topology.bodies.len();
        let state = &self.work.state;
        [&state.q[..bodies], &state.v[..bodies]].concat()
    }

    /// Seconds since the start.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// How the integration has fared so far.
    pub fn report(&self) -> Report {
        self.report
    }

    /// Takes the inputs of a row, on the way to the next where an actuator holds linearly.
    pub(crate) fn take_inputs(&mut self, drive: &Drive, row: usize, ahead: Option<f64>) {
        for input in 0..self.topology.inputs {
            let now = drive.at(row, input);
            let slope = ahead.map_or(0.0, |dt| (drive.at(row + 1, input) - now) / dt);
            self.work.inputs.held[input] = S::constant(now);
            self.work.inputs.slope[input] = S::constant(slope);
        }
        self.tau = 0.0;
    }

    /// Advances by `dt` with the inputs that were taken.
    pub(crate) fn step(&mut self, dt: f64) -> Result<(), SimulationError> {
        if self.topology.rates_vary {
            self.watch_rate(dt);
        }
        let count = rate::substeps(&self.topology, self.rate, dt)?;
        let h = dt / count as f64;
        for substep in 0..count {
            let tau = substep as f64 * h;
            self.work.advance(&self.topology, tau, h, &mut self.report);
        }
        self.report.substeps += count;
        self.report.most_substeps = self.report.most_substeps.max(count);
        self.time += dt;
        self.tau = dt;
        let bodies = self.topology.bodies.len();
        let state = &self.work.state;
        let finite = |x: &[S]| x[..bodies].iter().all(|x| x.value().is_finite());
        if finite(&state.q) && finite(&state.v) {
            Ok(())
        } else {
            Err(SimulationError::Diverged { time: self.time })
        }
    }

    /// Looks at the rate here and keeps the largest so far, so that a stiffening spring is not taken
    /// for soft each time it passes its rest.
    fn watch_rate(&mut self, ahead: f64) {
        let here = self.work.rate(&self.topology, ahead);
        if here.0 > self.rate.0 || here.0.is_nan() {
            self.rate = here;
        }
        self.report.rate = self.rate.0;
    }
}
