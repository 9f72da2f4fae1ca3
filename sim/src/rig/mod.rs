//! The rig file: what the owner of a device believes about it, typed, and with its lines kept.

mod column;
mod components;
mod effect_tables;
mod extend;
mod geometry;
mod laws;
mod names;
mod per_recording;
mod reader;
mod sections;
mod signals;
mod tables;
mod write;

use crate::effects::Kind;
use crate::error::Error;
use crate::suggest;
use crate::unit::Motion;
pub use geometry::{
    Axis, Chain, Geometry, Hasel, HaselReading, Magnet, Magnetometer, Plate, Route, Shape,
    Waveguide,
};
pub use laws::{AppliedLaw, LAW_FORMAT, LearnedLaw};
use reader::Source;
pub use reader::{Span, Spanned, TableReader};
use std::path::Path;
pub use tables::Tables;

/// The name of the file format, and its version.
pub const FORMAT: &str = "sinew-rig/1";

/// A rig file that was read and found sound.
///
/// The text it came from stays with it: writing a rig back gives the user's file, comments and
/// layout included, with other numbers in it.
///
/// ```
/// use sinew_sim::Rig;
/// let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\n\
///             motion = \"slide\"\ninertia = 1.0 # kg\n";
/// let rig = Rig::parse(text, "x.toml")?;
/// assert_eq!(rig.bodies[0].name, "mass");
/// let heavier = rig.with_values(&[("mass.inertia", 1.5)])?;
/// assert!(heavier.to_toml().ends_with("inertia = 1.5 # kg\n"));
/// # Ok::<(), sinew_sim::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Rig {
    pub(crate) text: String,
    /// The file as the user named it.
    pub file: String,
    /// The device's name.
    pub name: String,
    /// Coordinates with inertia, in file order, as all that follows; those that chains and plates
    /// become come last.
    pub bodies: Vec<Body>,
    /// Springs between bodies, or a body and the ground.
    pub springs: Vec<Spring>,
    /// Dampers between bodies, or a body and the ground.
    pub dampers: Vec<Damper>,
    /// Weights.
    pub gravities: Vec<Gravity>,
    /// Tendons along a path of bodies.
    pub tendons: Vec<Tendon>,
    /// Actuators: inputs to forces.
    pub actuators: Vec<Actuator>,
    /// Sensors: readings to signals.
    pub sensors: Vec<Sensor>,
    /// Columns that parameters may depend on, as the rig declares them.
    pub signals: Vec<Signal>,
    /// Learned laws of springs and dampers, as the rig holds them.
    pub laws: Vec<LearnedLaw>,
    /// Physics beyond the textbook.
    pub effects: Vec<EffectTable>,
    /// Components with a shape: chains, plates and their sensors.
    pub geometry: Geometry,
}

/// A parameter: a bare number is known and held, `{ value, min, max }` is believed and free.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::Rig;
/// let rig = Rig::parse(text, "x.toml")?;
/// let stiffness = &rig.springs[0].stiffness;
/// assert_eq!((stiffness.value, stiffness.min, stiffness.free), (40.0, Some(1.0), true));
/// assert!(!rig.bodies[0].inertia.free);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Value {
    /// The number.
    pub value: f64,
    /// Below this it makes no sense to its owner.
    pub min: Option<f64>,
    /// Above this it makes no sense to its owner.
    pub max: Option<f64>,
    /// A fit may change it.
    pub free: bool,
    /// Column of the recording that it changes with, if one does.
    pub with: Option<Box<Dependence>>,
    /// Each recording has a value of its own; `value` is what they share.
    pub per_recording: bool,
    pub(crate) place: Place,
}

/// Dependence of a parameter on a column of the recording: `value + slope * signal`
/// (docs/explanation/plant.md, eq. 26).
#[derive(Clone, Debug)]
pub struct Dependence {
    /// Name of a `[[signal]]`, or a column.
    pub signal: String,
    /// Change of the parameter by one unit of the signal.
    pub slope: Value,
    /// Line of the `with` key, for errors about the recording.
    pub line: usize,
}

/// Column of the recording that drives nothing, and that parameters may depend on: a pressure, a
/// voltage, a temperature.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Unique among the signals.
    pub name: String,
    /// Column of the recording.
    pub column: String,
    /// Time constant with which the rig follows the column, s; none: at once.
    pub lag: Option<Value>,
    /// Factor of the column's unit to SI (the `unit` key; 1 without one).
    pub column_factor: f64,
    /// Line of the `column` key, for errors about the recording.
    pub line: usize,
}

/// Place of a parameter in the file, also of one that is not written there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Array of tables at the top: `body`.
    pub(crate) table: &'static str,
    /// Index in that array.
    pub(crate) index: usize,
    /// An array inside it and which of its entries: `path`, 1.
    pub(crate) within: Option<(&'static str, usize)>,
    /// The key.
    pub(crate) key: String,
    /// It is the `slope` in the table of that key, and not its `value`.
    pub(crate) slope: bool,
    /// Its line, from 1; that of the table where it is not written.
    pub(crate) line: usize,
}

/// One coordinate with inertia.
#[derive(Clone, Debug)]
pub struct Body {
    /// Unique in the file.
    pub name: String,
    /// Line or axis.
    pub motion: Motion,
    /// kg or kg m^2, positive; zero or more of a body whose motion is imposed.
    pub inertia: Value,
    /// Column that imposes its coordinate, if one does.
    pub motion_from: Option<MotionColumn>,
    /// Initial position, if the rig has one.
    pub start: Option<Value>,
    /// Initial velocity, if the rig has one.
    pub start_velocity: Option<Value>,
}

/// Column of the recording that imposes a body's coordinate.
#[derive(Clone, Debug)]
pub struct MotionColumn {
    /// Its name.
    pub column: String,
    /// Factor of the column's unit to SI (the `unit` key; 1 without one).
    pub column_factor: f64,
    /// Line of the `motion_from` key, for errors about the recording.
    pub line: usize,
}

/// An end of a spring or damper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Does not move.
    Ground,
    /// Index of a body.
    Body(usize),
}

/// Force on `to` = -stiffness (q_to - q_from - rest).
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::Rig;
/// use sinew_sim::rig::End;
/// let rig = Rig::parse(text, "x.toml")?;
/// assert_eq!((rig.springs[0].from, rig.springs[0].to), (End::Ground, End::Body(0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Spring {
    /// Unique in the file.
    pub name: String,
    /// One end.
    pub from: End,
    /// The end that the sign of the force belongs to.
    pub to: End,
    /// N/m or N m/rad; zero beside a law.
    pub stiffness: Value,
    /// m or rad.
    pub rest: Value,
    /// Learned law in the place of the stiffness.
    pub law: Option<AppliedLaw>,
}

/// Force on `to` = -damping (v_to - v_from).
#[derive(Clone, Debug)]
pub struct Damper {
    /// Unique in the file.
    pub name: String,
    /// One end.
    pub from: End,
    /// The end that the sign of the force belongs to.
    pub to: End,
    /// N s/m or N m s/rad; zero beside a law.
    pub damping: Value,
    /// Learned law in the place of the damping.
    pub law: Option<AppliedLaw>,
}

/// Slide: force = -amplitude. Hinge: torque = -amplitude sin(q - zero).
#[derive(Clone, Debug)]
pub struct Gravity {
    /// Unique in the file.
    pub name: String,
    /// Index of the body.
    pub body: usize,
    /// N or N m.
    pub amplitude: Value,
    /// Angle at which a hinge hangs, rad.
    pub zero: Value,
}

/// Tension = pretension + stiffness (sum arm_i q_i - p) + damping sum arm_i v_i; pulls each body of
/// its path with -arm_i times that.
#[derive(Clone, Debug)]
pub struct Tendon {
    /// Unique in the file.
    pub name: String,
    /// (index of the body, arm in m or +-1).
    pub path: Vec<(usize, Value)>,
    /// Chains that it follows and plates that it holds.
    pub routes: Vec<Route>,
    /// N/m.
    pub stiffness: Value,
    /// N s/m.
    pub damping: Value,
    /// N.
    pub pretension: Value,
    /// It cannot push.
    pub unilateral: bool,
}

/// Component that an actuator acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drives {
    /// Index of a body: the force is gain times input.
    Body(usize),
    /// Index of a tendon: the length let out is gain times input.
    Tendon(usize),
    /// Index of a HASEL actuator: the voltage that charges it is gain times input.
    Hasel(usize),
}

/// Hold of an input between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// Keeps its value.
    Zero,
    /// Goes straight to the next one.
    Linear,
}

/// Proportional position loop in the firmware of a servo: the force is the actuator's gain times
/// what a dead band leaves of the difference between input and coordinate, within a limit.
#[derive(Clone, Debug)]
pub struct PositionLoop {
    /// Largest difference that moves nothing, m or rad.
    pub dead_band: Option<Value>,
    /// Largest force of the loop, N or N m.
    pub effort_limit: Option<Value>,
}

/// Action of a column of the recording on the rig.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::Rig;
/// use sinew_sim::rig::{Drives, Hold};
/// let rig = Rig::parse(text, "x.toml")?;
/// let actuator = &rig.actuators[0];
/// assert_eq!((actuator.drives, actuator.hold), (Drives::Body(0), Hold::Zero));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Actuator {
    /// Unique in the file.
    pub name: String,
    /// Body or tendon.
    pub drives: Drives,
    /// Column of the recording.
    pub input: String,
    /// Between samples.
    pub hold: Hold,
    /// N, N m or m per unit of the input; with a position loop per m or rad of its error.
    pub gain: Value,
    /// The input is a position that the actuator's own firmware goes to.
    pub position_loop: Option<PositionLoop>,
    /// Limits of a controller's command, lower and upper, SI.
    pub limit: Option<(f64, f64)>,
    /// Limit of a controller's change per second, SI.
    pub rate_limit: Option<f64>,
    /// Factor of the column's unit to SI (the `unit` key; 1 without one).
    pub column_factor: f64,
    /// Line of the `input` key, for errors about the recording.
    pub line: usize,
}

/// Reading of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reads {
    /// Coordinate of the body of that index.
    Position(usize),
    /// Its rate.
    Velocity(usize),
    /// Force or torque that the imposed motion of the body of that index needs.
    Effort(usize),
    /// The same without the force of the actuator of that index, which drives the body.
    ActuatorEffort(usize),
    /// Tension of the tendon of that index.
    Tension(usize),
    /// Something that follows from where things are.
    Shape(Shape),
    /// Voltage or stroke of the HASEL actuator of that index.
    Hasel(usize, HaselReading),
}

/// Signal = gain * reading + offset, a column of the recording.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::Rig;
/// use sinew_sim::rig::Reads;
/// let rig = Rig::parse(text, "x.toml")?;
/// assert_eq!(rig.sensors[0].reads, Reads::Position(0));
/// assert_eq!(rig.sensors[0].column_factor, 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Sensor {
    /// Unique in the file.
    pub name: String,
    /// Its reading.
    pub reads: Reads,
    /// Column of the recording.
    pub signal: String,
    /// Per unit of the reading; not zero.
    pub gain: Value,
    /// SI.
    pub offset: Value,
    /// Factor of the column's unit to SI (the `unit` key; 1 without one).
    pub column_factor: f64,
    /// Line of the `signal` key, for errors about the recording.
    pub line: usize,
}

/// Place of an `[[effect]]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// Index of a body.
    Body(usize),
    /// Index of a spring.
    Spring(usize),
    /// Index of a tendon.
    Tendon(usize),
    /// Index of an actuator.
    Actuator(usize),
    /// Index of a sensor.
    Sensor(usize),
    /// Indices of two bodies, the lower one first.
    Pair(usize, usize),
}

/// Physics beyond the textbook.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n";
/// use sinew_sim::Rig;
/// use sinew_sim::rig::Site;
/// let effect = "[[effect]]\nkind = 'coulomb_friction'\ncomponent = 'm'\nlevel = 20.0\n";
/// let rig = Rig::parse(&format!("{text}{effect}"), "x.toml")?;
/// let friction = &rig.effects[0];
/// assert_eq!(friction.kind.description().kind, "coulomb_friction");
/// assert_eq!((friction.site, friction.parameters[0].value), (Site::Body(0), 20.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct EffectTable {
    /// Its law.
    pub kind: Kind,
    /// Its place.
    pub site: Site,
    /// Its parameters, in the order of its description.
    pub parameters: Vec<Value>,
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// The file cannot be read, or [`Rig::parse`] refuses it.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| Error {
            file: file.clone(),
            line: None,
            column: None,
            message: format!("cannot read the rig: {error}"),
            help: (error.kind() == std::io::ErrorKind::NotFound)
                .then(|| suggest::nearest_file(path))
                .flatten(),
        })?;
        Self::parse(&text, &file)
    }

    /// Understands the text of a rig file; `file` is its name in errors.
    ///
    /// # Errors
    /// The first thing that is wrong, with its line and column, what was expected, and the name
    /// that was probably meant. No text makes it panic.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let source = Source::new(file, text);
        let text = laws::with_files(&source)?;
        let source = Source::new(file, &text);
        let document = source.document()?;
        components::read_rig(&source, document.as_table())
    }

    /// The name that a body of a rig is known by; `ground` for the ground.
    pub fn end_name(&self, end: End) -> &str {
        match end {
            End::Ground => "ground",
            End::Body(body) => &self.bodies[body].name,
        }
    }

    /// The name of the component where an effect sits; `a+b` of a pair.
    pub fn site_name(&self, site: Site) -> String {
        let body = |body: usize| &self.bodies[body].name;
        match site {
            Site::Body(index) => body(index).clone(),
            Site::Spring(spring) => self.springs[spring].name.clone(),
            Site::Tendon(tendon) => self.tendons[tendon].name.clone(),
            Site::Actuator(actuator) => self.actuators[actuator].name.clone(),
            Site::Sensor(sensor) => self.sensors[sensor].name.clone(),
            Site::Pair(a, b) => format!("{}+{}", body(a), body(b)),
        }
    }

    /// Line or axis, of a body or of the bodies that a spring joins; of what an actuator drives and
    /// a sensor reads.
    pub fn site_motion(&self, site: Site) -> Motion {
        match site {
            Site::Body(body) | Site::Pair(body, _) => self.bodies[body].motion,
            Site::Spring(spring) => {
                self.ends_motion(self.springs[spring].from, self.springs[spring].to)
            }
            Site::Tendon(_) => Motion::Slide,
            Site::Actuator(actuator) => match self.actuators[actuator].drives {
                Drives::Body(body) => self.bodies[body].motion,
                Drives::Tendon(_) | Drives::Hasel(_) => Motion::Slide,
            },
            Site::Sensor(sensor) => match self.sensors[sensor].reads {
                Reads::Position(body) | Reads::Velocity(body) | Reads::Effort(body) => {
                    self.bodies[body].motion
                }
                Reads::ActuatorEffort(actuator) => self.site_motion(Site::Actuator(actuator)),
                Reads::Tension(_) | Reads::Shape(_) | Reads::Hasel(..) => Motion::Slide,
            },
        }
    }

    /// The motion of two ends, of which at least one is a body (the reader sees to that).
    pub(crate) fn ends_motion(&self, from: End, to: End) -> Motion {
        match (from, to) {
            (_, End::Body(body)) | (End::Body(body), End::Ground) => self.bodies[body].motion,
            (End::Ground, End::Ground) => Motion::Slide,
        }
    }
}
