//! The plant: a rig compiled to indices, with every number in a parameter slot.

mod attach;
mod compile;
mod effort;
pub(crate) mod forces;
pub(crate) mod hasel;
mod initial;
pub(crate) mod input_signal;
pub(crate) mod motion;
mod shapes;
mod slots;
mod switch;
pub(crate) mod topology;

use crate::error::{Error, SimulationError};
use crate::imposed_motion::ImposedMotion;
use crate::law::Curve;
use crate::rig::{Hold, Place, Rig};
use crate::settings::SimulationSettings;
pub(crate) use compile::parameters;
pub use shapes::{Outline, Role};
use std::sync::Arc;
use topology::Topology;

/// Meaning of a number of the rig, for those who ask which numbers can stand for each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Position or velocity at which a simulation starts.
    Start,
    /// Reading or position that counts as zero, and is zero where nothing is said: a sensor's
    /// offset, a spring's rest, the angle of a weight.
    Zero,
    /// Damping of a component of the rig's own.
    Damping,
    /// Number of an effect.
    Effect,
    /// Any other number.
    Other,
}

impl Meaning {
    /// Meaning of the number at a place of the file.
    fn of(place: &Place) -> Self {
        if place.slope {
            return Self::Other;
        }
        match (place.table, place.key.as_str()) {
            ("effect", _) => Self::Effect,
            (_, "start" | "start_velocity") => Self::Start,
            (_, "offset" | "rest" | "zero") => Self::Zero,
            (_, "damping") => Self::Damping,
            _ => Self::Other,
        }
    }
}

/// One number of the rig.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::{Meaning, Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let slot = plant.slot("k.stiffness").expect("the rig has a spring k");
/// let stiffness = &plant.parameters()[slot];
/// assert_eq!((stiffness.value, stiffness.unit.as_str()), (40.0, "N/m"));
/// assert_eq!((stiffness.free, stiffness.min), (true, Some(1.0)));
/// assert_eq!(stiffness.meaning, Meaning::Other);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// `carriage.inertia`, `flexor.arm.motor`, `carriage.coulomb_friction.level`.
    pub name: String,
    /// Its meaning.
    pub meaning: Meaning,
    /// SI.
    pub unit: String,
    /// As the rig has it.
    pub value: f64,
    /// Its owner's lower bound.
    pub min: Option<f64>,
    /// Its owner's upper bound.
    pub max: Option<f64>,
    /// A fit may change it.
    pub free: bool,
    /// The rig file allows zero or more, whatever the bounds.
    pub non_negative: bool,
    /// Each recording has a value of its own; `value` is what they share.
    pub per_recording: bool,
}

/// A distinct column of the recording that drives the plant; actuators may share one. After those
/// of the actuators come columns that parameters depend on, then those that impose a motion, four
/// times each, once a [`MotionQuantity`].
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::{Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let input = &plant.inputs()[0];
/// assert_eq!((input.column.as_str(), input.unit()), ("u_N", "N"));
/// assert_eq!(input.wanted_by(), "actuator `a` of the rig");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The column's name.
    pub column: String,
    /// The first actuator that takes it; the signal that it is; the body whose motion it imposes.
    pub actuator: String,
    /// Hold between samples at that actuator.
    pub hold: Hold,
    /// Limits of a controller's command, lower and upper, SI: the narrowest of all its actuators.
    pub limit: Option<(f64, f64)>,
    /// Limit of a controller's change per second, SI.
    pub rate_limit: Option<f64>,
    /// Multiply the column by this to get SI (the rig's `unit` key; 1 without one).
    pub column_factor: f64,
    /// Line of the rig where the column is named.
    pub line: usize,
    /// Quantity that is derived from the column, where the column imposes a motion.
    pub motion: Option<MotionQuantity>,
    /// It drives nothing: parameters depend on it.
    pub exogenous: bool,
}

/// Quantity of an imposed motion, derived from the column with the coordinate
/// ([`ImposedMotion`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionQuantity {
    /// Smoothed coordinate.
    Position,
    /// Its rate.
    Velocity,
    /// The rate of that.
    Acceleration,
    /// Standard deviation of the velocity.
    VelocityDeviation,
}

impl MotionQuantity {
    /// All of them, in the order of a body's inputs.
    pub(crate) const ALL: [Self; motion::INPUTS] = [
        Self::Position,
        Self::Velocity,
        Self::Acceleration,
        Self::VelocityDeviation,
    ];
}

impl Input {
    /// Its owner in errors: the actuator or the body.
    pub fn wanted_by(&self) -> String {
        match self.motion {
            None if self.exogenous => format!("signal `{}` of the rig", self.actuator),
            None => format!("actuator `{}` of the rig", self.actuator),
            Some(_) => format!("`motion_from` of body `{}` of the rig", self.actuator),
        }
    }

    /// The unit of its values, of its limits and of what a controller commands: the column's own,
    /// or SI where the rig's `unit` key converts it. Empty where the column names none.
    pub fn unit(&self) -> &str {
        let written = crate::unit::of_column(&self.column);
        if self.column_factor == 1.0 {
            written
        } else {
            crate::unit::si(written)
        }
    }
}

/// A column that the plant writes.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::{Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let sensor = &plant.sensors()[0];
/// assert_eq!((sensor.column.as_str(), sensor.column_factor), ("q_mm", 1e-3));
/// assert_eq!(sensor.position_of, Some(0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SensorChannel {
    /// The sensor's name.
    pub name: String,
    /// The column's name.
    pub column: String,
    /// Unit of the signal, from the column's name; SI where the rig has a `unit` key.
    pub unit: String,
    /// Multiply the column by this to get SI (the rig's `unit` key; 1 without one).
    pub column_factor: f64,
    /// Index of the body whose position it reads, if that is what it reads.
    pub position_of: Option<usize>,
    /// Line of the rig where the column is named.
    pub line: usize,
}

/// A rig compiled for simulation. Cheap to clone: the parts are shared.
///
/// All numbers that go in and out are SI; a column in another unit is converted where the
/// recording is read, by [`Input::column_factor`] and [`SensorChannel::column_factor`].
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n";
/// use sinew_sim::{Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// assert_eq!(plant.state_names(), ["m.position", "m.velocity"]);
/// assert_eq!(plant.slot("m.inertia"), Some(0));
/// assert_eq!(plant.values(), [2.0]);
/// # Ok::<(), sinew_sim::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plant {
    pub(crate) topology: Arc<Topology>,
    parameters: Arc<[Parameter]>,
    inputs: Arc<[Input]>,
    sensors: Arc<[SensorChannel]>,
    settings: SimulationSettings,
}

impl Plant {
    /// Compiles a rig.
    ///
    /// # Errors
    /// None beyond what [`Rig::parse`] refuses: two columns that share a name but not their unit.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        compile::compile(rig)
    }

    /// The same plant, integrated in another way.
    pub fn with_settings(&self, settings: SimulationSettings) -> Self {
        Self {
            settings,
            ..self.clone()
        }
    }

    /// Settings of its integrator.
    pub fn settings(&self) -> SimulationSettings {
        self.settings
    }

    /// Every number of the rig, in slot order: component by component in file order.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The slot of a parameter.
    pub fn slot(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }

    /// The rig's own parameter values, in slot order.
    pub fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }

    /// Slots of the parameters that a fit may change.
    pub fn free_slots(&self) -> Vec<usize> {
        (0..self.parameters.len())
            .filter(|&slot| self.parameters[slot].free)
            .collect()
    }

    /// The columns that drive it, in order of first use.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// Replaces the columns of imposed motions, which hold the coordinate with NaN where it is
    /// missing, by the quantities that are derived from it. One column an input, SI, at these
    /// times; others stay. Each motion is smoothed once (docs/explanation/plant.md, eq. 24).
    ///
    /// # Errors
    /// `Shape` for a wrong number of columns, `NoInput` for fewer than six samples of a coordinate.
    pub fn derive_motions(
        &self,
        t: &[f64],
        columns: &mut [Vec<f64>],
    ) -> Result<(), SimulationError> {
        self.expect("input columns", self.inputs.len(), columns.len())?;
        let first = self.inputs.len() - motion::INPUTS * self.topology.imposed.len();
        for start in (first..self.inputs.len()).step_by(motion::INPUTS) {
            let motion = ImposedMotion::smooth(t, &columns[start]);
            let motion = motion.ok_or_else(|| SimulationError::TooFewSamples {
                column: self.inputs[start].column.clone(),
            })?;
            let derived = [
                motion.position,
                motion.velocity,
                motion.acceleration,
                motion.velocity_deviation,
            ];
            for (column, derived) in columns[start..].iter_mut().zip(derived) {
                *column = derived;
            }
        }
        Ok(())
    }

    /// True where a recording imposes the motion of some body.
    pub fn has_imposed_motion(&self) -> bool {
        !self.topology.imposed.is_empty()
    }

    /// Reason for which only recordings can drive the plant: a motion that is imposed, or a column
    /// that parameters depend on; `None` where commands can.
    pub fn only_recordings(&self) -> Option<String> {
        let body = self.inputs.iter().find(|input| input.motion.is_some());
        let signal = self.inputs.iter().find(|input| input.exogenous);
        match (body, signal) {
            (Some(body), _) => Some(format!(
                "the body `{}` with `motion_from` moves as a recording says",
                body.actuator
            )),
            (None, Some(signal)) => Some(format!(
                "parameters may depend on the column `{}`, which only a recording has",
                signal.column
            )),
            (None, None) => None,
        }
    }

    /// The columns that it writes, in file order.
    pub fn sensors(&self) -> &[SensorChannel] {
        &self.sensors
    }

    /// Number of states: a position and a velocity a body, those of hidden modes included, and the
    /// internal states of effects.
    pub fn state_len(&self) -> usize {
        2 * self.topology.names.len() + self.topology.internal.len()
    }

    /// True where commands of earlier periods act on, beside what the state says: a delay, a lag or
    /// play between a command and its effect.
    pub fn remembers_inputs(&self) -> bool {
        self.topology.shaped || self.topology.has_memory()
    }

    /// Products in one look at the forces, about: what a sub-step of the integrator costs.
    pub fn terms(&self) -> usize {
        let topology = &self.topology;
        let learned = |curve: &Option<Curve>| curve.map_or(0, |curve| 2 * curve.count);
        let springs = topology.springs.iter();
        let springs: usize = springs
            .map(|s| 1 + 3 * (s.laws.len() + s.memory.len()) + learned(&s.curve))
            .sum();
        // Stretch, its rate, and the pull on each body of the path; stiffness, damping, pretension.
        let tendons = topology.tendons.iter();
        let tendons: usize = tendons.map(|t| 3 * t.path.len() + t.lines.len() + 3).sum();
        let dampers = topology.dampers.iter().map(|d| 1 + learned(&d.curve));
        let others = topology.bodies.len()
            + dampers.sum::<usize>()
            + topology.motors.len()
            + 2 * (topology.loads.len() + topology.stops.len() + topology.frictions.len())
            + 3 * topology.presliding.len()
            + 3 * topology
                .frictions
                .iter()
                .map(|f| f.warming.len())
                .sum::<usize>();
        springs + tendons + others + 20 * topology.hasels.len()
    }

    /// Number of bodies, those of hidden modes included, which come last: the first so many states
    /// are positions, the next so many velocities, what follows is internal.
    pub fn bodies(&self) -> usize {
        self.topology.names.len()
    }

    /// Inertia of every body with these parameter values, kg or kg m^2: what a chain or a plate
    /// gives to its bodies, too.
    ///
    /// # Panics
    /// When there are fewer values than parameter slots.
    pub fn inertias(&self, values: &[f64]) -> Vec<f64> {
        let bodies = self.topology.bodies.iter();
        bodies.map(|body| values[body.inertia]).collect()
    }

    /// Names of the states, in order: every body's position, then every body's velocity, then
    /// internal states (`coil.hysteresis.z`, `encoder.sensor_lag.reading`).
    pub fn state_names(&self) -> Vec<String> {
        let of = |quantity: &'static str| {
            let names = self.topology.names.iter();
            names.map(move |body| format!("{body}.{quantity}"))
        };
        let internal = self.topology.internal.iter().cloned();
        of("position")
            .chain(of("velocity"))
            .chain(internal)
            .collect()
    }

    /// Places of the velocities among the states.
    pub fn velocities(&self) -> std::ops::Range<usize> {
        let bodies = self.topology.names.len();
        bodies..2 * bodies
    }
}
