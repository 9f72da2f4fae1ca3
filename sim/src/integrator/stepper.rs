//! A plant in time: state, inputs, and the step from one sample to the next.

use super::exact::{Exact, TransitionCache};
use super::input_chain::InputChain;
use super::signal::Signals;
use super::substep::Substep;
use crate::error::SimulationError;
use crate::input_trajectory::InputTrajectory;
use crate::plant::Plant;
use crate::plant::input_signal::{InputSignal, Shape};
use crate::plant::motion;
use crate::plant::topology::Topology;
use crate::rig::Reads;
use crate::scalar::Scalar;
use crate::settings::{IntegrationReport, SimulationSettings};
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
    pub(crate) topology: Arc<Topology>,
    pub(super) work: Substep<S>,
    pub(super) supply: InputChain<S>,
    pub(super) signals: Signals<S>,
    pub(super) report: IntegrationReport,
    pub(super) rate: (f64, usize),
    pub(super) time: f64,
    /// Time in the sample interval at which the inputs are read, s.
    pub(super) tau: f64,
    pub(super) settings: SimulationSettings,
    /// Inputs have been seen: lagged tensions have their first value.
    pub(super) filled: bool,
    /// By how much more than the rates say the last interval was refined, for a tolerance.
    pub(super) refinement: usize,
    /// The largest magnitude that each state has had.
    pub(super) largest: Vec<f64>,
    pub(super) exact: Exact<S>,
}

/// Bodies of the methods that [`Simulated`](crate::simulate::simulated::Simulated) compiles, once a
/// type.
impl<S: Scalar> Stepper<S> {
    pub(crate) fn begin(plant: &Plant, values: &[S], start: &[S]) -> Result<Self, SimulationError> {
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
        for (index, body) in topology.bodies.iter().enumerate() {
            let inertia = values[body.inertia].value();
            if inertia <= 0.0 && !topology.is_imposed(index) {
                return Err(SimulationError::Inertia {
                    at: topology.place(index),
                    value: inertia,
                });
            }
        }
        let mut stepper = Self {
            work: Substep::new(&topology, values, plant.settings().smoothing),
            supply: InputChain::new(&topology),
            signals: Signals::new(&topology),
            topology,
            report: IntegrationReport::default(),
            rate: (0.0, 0),
            time: 0.0,
            tau: 0.0,
            settings: plant.settings(),
            filled: false,
            refinement: 1,
            largest: Vec::new(),
            exact: Exact::new(),
        };
        stepper.place(start)?;
        stepper.watch_rate(0.0);
        Ok(stepper)
    }

    /// Simulates with what other simulations with the same numbers have found.
    pub(crate) fn share(&mut self, kept: Arc<TransitionCache<S>>) {
        self.exact.share(kept);
    }

    /// InputChainSlots of inputs begin where what was before the first row leaves them.
    pub(crate) fn replay_history(&mut self, drive: &InputTrajectory) {
        let work = &mut self.work;
        let (past, first) = (drive.past(), self.topology.acting);
        self.signals
            .replay(&self.topology, &work.dynamics.values, past, first);
        let (values, input_signals) = (&work.dynamics.values, &mut work.input_signals);
        self.supply
            .replay_history(&self.topology, values, drive, input_signals);
    }

    pub(crate) fn place(&mut self, state: &[S]) -> Result<(), SimulationError> {
        let bodies = self.topology.bodies.len();
        let expected = 2 * bodies + self.topology.internal.len();
        if state.len() != expected {
            return Err(SimulationError::Shape {
                what: "state".to_owned(),
                expected,
                found: state.len(),
            });
        }
        self.work.state.q[..bodies].copy_from_slice(&state[..bodies]);
        self.work.state.v[..bodies].copy_from_slice(&state[bodies..2 * bodies]);
        self.work.state.z.copy_from_slice(&state[2 * bodies..]);
        self.work.forget();
        self.refresh();
        Ok(())
    }

    pub(crate) fn pass(&mut self, dt: f64, [from, to]: [&[S]; 2]) -> Result<(), SimulationError> {
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
            self.take(index, from, (to - from) / dt);
        }
        self.step(dt)
    }

    pub(crate) fn sensor_signal(&self, sensor: usize) -> S {
        let at = self.work.point(S::constant(self.tau));
        self.topology.signal(sensor, &at)
    }

    pub(crate) fn append_signals(&self, out: &mut Vec<S>) {
        let at = self.work.point(S::constant(self.tau));
        self.topology.signals(&at, out);
    }

    /// Positions, velocities, internal states: the order of [`Plant::state_names`].
    pub fn state(&self) -> Vec<S> {
        let bodies = self.topology.bodies.len();
        let state = &self.work.state;
        [&state.q[..bodies], &state.v[..bodies], &state.z].concat()
    }

    /// Seconds since the start.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Report of the integration so far.
    pub fn report(&self) -> IntegrationReport {
        self.report
    }

    /// Takes the inputs of a row, on the way to the next where an actuator holds linearly.
    pub(crate) fn set_inputs(&mut self, drive: &InputTrajectory, row: usize, ahead: Option<f64>) {
        for input in 0..self.topology.inputs {
            let now = drive.at(row, input);
            let slope = ahead.map_or(0.0, |dt| (drive.at(row + 1, input) - now) / dt);
            self.take(input, S::constant(now), S::constant(slope));
        }
        self.present();
    }

    /// Takes a column's value and slope from now on.
    pub(crate) fn take(&mut self, input: usize, value: S, slope: S) {
        let beyond = input.checked_sub(self.topology.acting);
        let signals = self.topology.signals.len();
        if let Some(signal) = beyond.filter(|&beyond| beyond < signals) {
            return self.take_signal(signal, value);
        }
        if let Some(motion) = beyond.map(|beyond| beyond - signals) {
            let (index, which) = (motion / motion::INPUTS, motion % motion::INPUTS);
            let work = &mut self.work;
            let motion = &mut work.dynamics.motions[index];
            motion.take(which, value.value(), slope.value());
            let body = motion.body;
            work.state.q[body] = motion.position(S::ZERO);
            work.state.v[body] = motion.velocity(S::ZERO);
            work.plain.dynamics.motions[index].clone_from(motion);
            return;
        }
        if self.topology.shaped {
            self.supply.take(input, self.time, value, slope);
            return;
        }
        for (input_signal, line) in self.work.input_signals.iter_mut().zip(&self.topology.lines) {
            if line.input == input {
                *input_signal = InputSignal {
                    shape: if line.linear {
                        Shape::Ramp
                    } else {
                        Shape::Held
                    },
                    c: [value, slope, S::ZERO],
                    ..InputSignal::ZERO
                };
            }
        }
    }

    /// Takes the value of a column that parameters depend on, which holds until the next row.
    fn take_signal(&mut self, signal: usize, value: S) {
        let (slots, values) = (&self.topology.signals[signal], &self.work.dynamics.values);
        self.signals.take(signal, slots, values, (self.time, value));
        self.depend();
    }

    /// Puts parameters where the signals are.
    fn depend(&mut self) {
        let (topology, work) = (&*self.topology, &mut self.work);
        work.dynamics.depend(topology, self.signals.now());
        work.plain.dynamics.take_depending(topology, &work.dynamics);
    }

    /// Fits the imposed motions to an interval of `dt`.
    pub(super) fn span_motions(&mut self, dt: f64) {
        let work = &mut self.work;
        let plain = &mut work.plain.dynamics.motions;
        for (motion, plain) in work.dynamics.motions.iter_mut().zip(plain) {
            motion.span(dt);
            plain.clone_from(motion);
        }
    }

    /// The inputs that were taken act from now on: what sensors see of them.
    pub(crate) fn present(&mut self) {
        self.tau = 0.0;
        if self.topology.shaped {
            let work = &mut self.work;
            let values = &work.dynamics.values;
            self.supply.begin(&self.topology, values, self.time);
            let input_signals = &mut work.input_signals;
            let _ = self.supply.next_piece(
                &self.topology,
                values,
                self.time,
                S::ZERO,
                1.0,
                input_signals,
            );
        }
        self.refresh();
        if !self.filled {
            self.fill();
        }
    }

    /// Branches of laws where the state is, for sensors.
    pub(super) fn refresh(&mut self) {
        self.work.refresh(&self.topology, S::constant(self.tau));
    }

    /// A lagged tension starts at the tension, which is known once the inputs are.
    fn fill(&mut self) {
        for &sensor in &self.topology.lagging {
            let described = &self.topology.sensors[sensor];
            let needs_inputs = matches!(
                described.reads,
                Reads::Tension(_) | Reads::Effort(_) | Reads::ActuatorEffort(_)
            );
            if let (true, Some((_, state))) = (needs_inputs, described.lag) {
                let at = self.work.point(S::constant(self.tau));
                let reading = self.topology.reading(sensor, &at);
                self.work.state.z[state] = reading;
            }
        }
        self.filled = true;
    }

    /// State that one row hands to the next, the memory of the input chains included.
    pub(crate) fn carried(&self) -> Vec<S> {
        let mut carried = self.state();
        carried.extend(self.supply.kept());
        carried.extend(self.signals.kept());
        carried
    }

    /// The same stepper in other numbers: `carried` as [`Stepper::carried`] gives it, past samples
    /// by their column and time.
    pub(crate) fn lifted<T: Scalar>(
        &self,
        plant: &Plant,
        values: &[T],
        carried: &[T],
        sample: impl FnMut(usize, f64) -> (T, T),
    ) -> Result<Stepper<T>, SimulationError> {
        let (state, kept) = carried.split_at(plant.state_len());
        let signals = kept.len() - Signals::<T>::kept_len(&self.topology);
        let (kept, signals) = kept.split_at(signals);
        let mut lifted = Stepper::begin(plant, values, state)?;
        lifted.signals = self.signals.lifted(signals);
        lifted.depend();
        lifted.supply = self.supply.lifted(kept, sample);
        lifted.report = self.report;
        let rests = &self.work.modes.friction;
        lifted.work.modes.friction.clone_from(rests);
        lifted.rate = self.rate;
        lifted.time = self.time;
        lifted.tau = self.tau;
        lifted.filled = true;
        lifted.refinement = self.refinement;
        lifted.largest.clone_from(&self.largest);
        lifted.exact = self.exact.lifted();
        Ok(lifted)
    }
}
