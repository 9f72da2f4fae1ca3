//! Knowledge about an effect without simulating it: all that a diagnosis is written against.

use crate::unit::Quantity;

/// Place of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// A body: position and velocity are its coordinate and its rate.
    Body,
    /// A spring: position is the extension beyond its rest, the force acts on its `to`.
    Spring,
    /// A tendon: velocity is the rate of its path's length.
    Tendon,
    /// An actuator: its input before the gain.
    Actuator,
    /// A sensor: its reading before the gain.
    Sensor,
    /// Two bodies, written `a+b`.
    Pair,
}

impl Port {
    /// The component in a sentence, with its article.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Body => "a body",
            Self::Spring => "a spring",
            Self::Tendon => "a tendon",
            Self::Actuator => "an actuator",
            Self::Sensor => "a sensor",
            Self::Pair => "a pair of bodies",
        }
    }
}

/// Kind of physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Depends on the direction of motion, and truly sticks.
    Friction,
    /// Smooth in velocity.
    Damping,
    /// A potential of an extension.
    Stiffness,
    /// A force that is there on one side of a position only.
    Gap,
    /// A force that depends on what went before.
    Memory,
    /// A force from outside.
    Load,
    /// Another coordinate.
    Mode,
    /// Between the recorded input and the force.
    Actuator,
    /// Between the reading and the recorded signal.
    Sensor,
    /// Without a name: outside the vocabulary.
    Learned,
}

impl Family {
    /// True if a search takes its forces with either sign, so that a wrong sign shows instead of
    /// hiding behind a bound.
    pub fn searched_with_either_sign(self) -> bool {
        matches!(
            self,
            Self::Friction | Self::Damping | Self::Stiffness | Self::Load
        )
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Damping => "damping",
            Self::Stiffness => "stiffness",
            Self::Gap => "gap",
            Self::Memory => "memory",
            Self::Load => "load",
            Self::Mode => "mode",
            Self::Actuator => "actuator",
            Self::Sensor => "sensor",
            Self::Learned => "learned",
        }
    }
}

/// Change of the rig's energy by an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Energy {
    /// Never adds any: what it stores it gives back at most.
    Dissipates,
    /// Gives back what it took: there is a potential.
    Conserves,
    /// Changes what is put in or read out, which has no energy of the rig.
    Outside,
}

impl Energy {
    /// It cannot make the rig move by itself.
    pub fn passive(self) -> bool {
        self != Self::Outside
    }
}

/// Values of a parameter that make sense in a rig file. A fit may go elsewhere and be judged
/// after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Any finite number.
    Any,
    /// Zero or more.
    NonNegative,
    /// More than zero.
    Positive,
    /// Any finite number but zero.
    NonZero,
    /// +1 or -1: which side is meant.
    Side,
}

impl Sign {
    /// True if a rig file may give this number.
    pub fn admits(self, number: f64) -> bool {
        self.wanted(number).is_none()
    }

    /// Expectation in place of a number that a rig file may not give.
    pub(crate) fn wanted(self, number: f64) -> Option<&'static str> {
        match self {
            _ if !number.is_finite() => Some("a finite number"),
            Self::NonNegative if number < 0.0 => Some("zero or more"),
            Self::Positive if number <= 0.0 => Some("more than zero"),
            Self::NonZero if number == 0.0 => Some("a number that is not zero"),
            Self::Side if number.abs() != 1.0 => Some("1 or -1"),
            _ => None,
        }
    }
}

/// Part of a parameter in the law of its effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Scales the effect: a small value makes a weak effect, for which linear theory holds.
    Strength,
    /// Position at which the effect acts.
    Place,
    /// Rate, time or distance over which the effect acts.
    Shape,
}

/// Values that a search may try for a parameter, relative to the values that it began with.
///
/// ```
/// use sinew_sim::effects::SearchRange;
/// let start = |_: &str| 0.4;
/// assert_eq!(SearchRange::AtLeast(0.25).bounds("velocity", start), [0.1, f64::INFINITY]);
/// assert_eq!(SearchRange::Fixed([0.5, 2.0]).bounds("exponent", start), [0.5, 2.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SearchRange {
    /// Any number.
    Unlimited,
    /// At least this part of the magnitude of its start.
    AtLeast(f64),
    /// Within these two numbers, in the unit of the parameter.
    Fixed([f64; 2]),
    /// Magnitude of at most this multiple of the largest start among the named parameters.
    WithinLargest(f64, &'static [&'static str]),
}

impl SearchRange {
    /// Lowest and highest value for the parameter `own`; `start` gives the start of a parameter by
    /// its name.
    pub fn bounds(self, own: &str, start: impl Fn(&str) -> f64) -> [f64; 2] {
        match self {
            Self::Unlimited => [f64::NEG_INFINITY, f64::INFINITY],
            Self::AtLeast(part) => [part * start(own).abs(), f64::INFINITY],
            Self::Fixed(range) => range,
            Self::WithinLargest(times, names) => {
                let starts = names.iter().map(|name| start(name).abs());
                let most = times * starts.fold(0.0, f64::max);
                [-most, most]
            }
        }
    }
}

/// One parameter of an effect, as it is written in a rig and reported by a diagnosis.
#[derive(Clone, Copy, Debug)]
pub struct ParameterSpec {
    /// Its key in the rig file.
    pub name: &'static str,
    /// Its quantity; with the port it becomes a unit.
    pub quantity: Quantity,
    /// Values that a rig file may give.
    pub sign: Sign,
    /// The value where the rig gives none; no value: it is required.
    pub default: Option<f64>,
    /// Says what is meant, and is not for a fit to change.
    pub held: bool,
    /// Part in the law.
    pub role: Role,
    /// Values that a search may try.
    pub range: SearchRange,
    /// At zero, with the effect's other parameters of this sort, the effect is not there.
    pub zero_means_absent: bool,
}

impl ParameterSpec {
    /// A required parameter that a fit may change, of the role [`Role::Shape`] and an unlimited
    /// range.
    pub const fn new(name: &'static str, quantity: Quantity, sign: Sign) -> Self {
        Self {
            name,
            quantity,
            sign,
            default: None,
            held: matches!(sign, Sign::Side),
            role: Role::Shape,
            range: SearchRange::Unlimited,
            zero_means_absent: !matches!(sign, Sign::Side | Sign::Positive),
        }
    }

    /// The same, of another role.
    pub const fn with_role(self, role: Role) -> Self {
        Self { role, ..self }
    }
}

pub(super) const fn parameter(name: &'static str, quantity: Quantity, sign: Sign) -> ParameterSpec {
    ParameterSpec::new(name, quantity, sign)
}

pub(super) const fn strength(name: &'static str, quantity: Quantity, sign: Sign) -> ParameterSpec {
    ParameterSpec::new(name, quantity, sign).with_role(Role::Strength)
}

/// A place, at which zero is as good as any other.
pub(super) const fn place(name: &'static str, quantity: Quantity, sign: Sign) -> ParameterSpec {
    ParameterSpec {
        role: Role::Place,
        zero_means_absent: false,
        ..ParameterSpec::new(name, quantity, sign)
    }
}

/// Knowledge about an effect without simulating it.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Its name in a rig file.
    pub kind: &'static str,
    /// The kind of physics.
    pub family: Family,
    /// Places where it can sit.
    pub ports: &'static [Port],
    /// Its change of the rig's energy.
    pub energy: Energy,
    /// The law in one line, in the letters of docs/explanation/plant.md and the names of its
    /// parameters.
    pub law: &'static str,
    /// The equation's number in docs/explanation/plant.md.
    pub equation: &'static str,
    /// Its parameters, in the order of the slots.
    pub parameters: &'static [ParameterSpec],
    /// Kinds that can look like it in a recording that does not excite the difference.
    pub confusable: &'static [&'static str],
    /// Property of a recording in which it shows.
    pub excited_by: &'static str,
    /// Sentence of a report: `{component}` and `{parameter}` stand for name and value.
    pub sentence: &'static str,
}

/// Words about an effect for somebody who meets its name for the first time (`sinew explain`).
#[derive(Clone, Copy, Debug)]
pub struct Explanation {
    /// Parts of devices that cause it, and what it does there.
    pub cause: &'static str,
    /// Meaning of each parameter by its name; `spring_*` stands for all that begin with `spring_`.
    pub parameters: &'static [(&'static str, &'static str)],
    /// Next step of a person whose diagnosis names it.
    pub next: &'static str,
}

impl Explanation {
    /// Tells whether an entry of [`Explanation::parameters`] is about a parameter.
    pub fn is_about(entry: &str, parameter: &str) -> bool {
        match entry.strip_suffix('*') {
            Some(beginning) => parameter.starts_with(beginning),
            None => entry == parameter,
        }
    }
}

/// Typical sizes at a port, from a recording: what start values of a fit are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Half the range of the body's coordinate, or of the extension of a spring or tendon; m or
    /// rad.
    pub position: f64,
    /// RMS of its rate; m/s or rad/s.
    pub velocity: f64,
    /// RMS of the other forces there; N or N m.
    pub force: f64,
    /// Inertia that is moved; kg or kg m^2.
    pub inertia: f64,
    /// Time in which the motion changes: position over velocity, say; s.
    pub time: f64,
    /// Interval between two samples, s.
    pub interval: f64,
    /// Largest magnitude of the input of an actuator, in its unit.
    pub input: f64,
    /// Largest magnitude of the reading of a sensor, in its unit.
    pub reading: f64,
    /// Smallest and largest coordinate that is met; m or rad.
    pub range: (f64, f64),
}
