//! The rig as indices: everything about a plant but its numbers, which are slots of a parameter
//! vector.

use super::shapes::Shapes;
use crate::effects::Kind;
use crate::error::BodyPlace;
use crate::law::Curve;
use crate::rig::Reads;
use crate::unit::Motion;

/// Most states of a rig that is solved exactly; beyond, a product costs more than it saves.
const MOST_STATES: usize = 12;

/// The ground is the body after the last one: it has position and velocity zero, and what pushes it
/// is forgotten.
#[derive(Debug, Default)]
pub(crate) struct Topology {
    /// The rig's file, for refusals.
    pub(crate) file: String,
    /// Names of the bodies, those of hidden modes last.
    pub(crate) names: Vec<String>,
    pub(crate) bodies: Vec<BodySlots>,
    pub(crate) springs: Vec<Spring>,
    pub(crate) dampers: Vec<Damper>,
    pub(crate) tendons: Vec<Tendon>,
    pub(crate) motors: Vec<Motor>,
    /// Effects on bodies that are smooth, gravity components among them.
    pub(crate) loads: Vec<Load>,
    pub(crate) stops: Vec<Stop>,
    /// One entry a direction in which something rubs.
    pub(crate) frictions: Vec<Friction>,
    /// Friction that yields before it slips, one entry a body that has it.
    pub(crate) presliding: Vec<Presliding>,
    /// Some friction acts on several bodies, so that what rests is held together.
    pub(crate) coupled: bool,
    /// Number of loads that friction follows.
    pub(crate) follows: usize,
    /// One entry an actuator.
    pub(crate) lines: Vec<Line>,
    /// Some line is more than its column.
    pub(crate) shaped: bool,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) inputs: usize,
    /// Those of the actuators, which come first.
    pub(crate) acting: usize,
    /// Columns that parameters depend on: their inputs follow those of the actuators.
    pub(crate) signals: Vec<SignalSlots>,
    /// Parameters that depend on them.
    pub(crate) depending: Vec<Depending>,
    /// Bodies whose motion the recording imposes, in the order of their inputs.
    pub(crate) imposed: Vec<usize>,
    /// Every body is imposed and nothing has a rate: there is nothing to integrate.
    pub(crate) prescribed: bool,
    /// Names of the internal states: those with a rate, then the lags of sensors.
    pub(crate) internal: Vec<String>,
    /// Number of those with a rate.
    pub(crate) rated: usize,
    /// Sensors with a lag, in the order of their states.
    pub(crate) lagging: Vec<usize>,
    /// Laws with branches.
    pub(crate) switches: Vec<Switch>,
    /// Some slope depends on the state, so that the fastest rate must be watched along the way.
    pub(crate) rates_vary: bool,
    /// Nothing but straight lines: the rates are affine in state and inputs.
    pub(crate) linear: bool,
    pub(crate) hasels: Vec<Hasel>,
    /// Components with a shape.
    pub(crate) shapes: Shapes,
}

/// A column that parameters depend on.
#[derive(Debug)]
pub(crate) struct SignalSlots {
    /// Time constant with which the rig follows it.
    pub(crate) lag: Option<usize>,
}

/// A parameter that depends on a signal (docs/explanation/plant.md, eq. 26).
#[derive(Debug)]
pub(crate) struct Depending {
    pub(crate) slot: usize,
    pub(crate) slope: usize,
    /// Index of the signal.
    pub(crate) signal: usize,
}

#[derive(Debug)]
pub(crate) struct BodySlots {
    /// Line of the rig where its inertia stands.
    pub(crate) line: usize,
    pub(crate) inertia: usize,
    pub(crate) start: Option<usize>,
    pub(crate) start_velocity: Option<usize>,
    /// The body that it starts with, of a hidden mode.
    pub(crate) host: Option<usize>,
}

#[derive(Debug)]
pub(crate) struct Spring {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) stiffness: usize,
    /// None: at zero.
    pub(crate) rest: Option<usize>,
    pub(crate) motion: Motion,
    /// A learned law in the place of a stiffness.
    pub(crate) curve: Option<Curve>,
    pub(crate) laws: Vec<Law>,
    pub(crate) gap: Option<Gap>,
    pub(crate) memory: Vec<Memory>,
}

/// A dead band and which switch says where in it the force is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    pub(crate) slot: usize,
    pub(crate) switch: usize,
}

/// A force in a spring that has a state of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Memory {
    /// Bouc-Wen; switches for the signs of velocity and state.
    Hysteresis {
        slot: usize,
        state: usize,
        direction: usize,
        side: usize,
    },
    /// A Maxwell branch.
    Creep { slot: usize, state: usize },
    /// A branch that yields; the switch says whether it does, and which way.
    Plastic {
        slot: usize,
        state: usize,
        switch: usize,
    },
}

/// An effect and the slot of its first parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    pub(crate) kind: Kind,
    pub(crate) slot: usize,
}

#[derive(Debug)]
pub(crate) struct Damper {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) damping: usize,
    /// A learned law in the place of a damping.
    pub(crate) curve: Option<Curve>,
}

#[derive(Debug)]
pub(crate) struct Tendon {
    /// (body, slot of its arm).
    pub(crate) path: Vec<(usize, usize)>,
    pub(crate) stiffness: usize,
    pub(crate) damping: usize,
    pub(crate) pretension: usize,
    /// It cannot push: taut or slack by this switch.
    pub(crate) unilateral: Option<usize>,
    pub(crate) slack: Option<usize>,
    pub(crate) gap: Option<Gap>,
    /// Actuators that let it out.
    pub(crate) lines: Vec<usize>,
}

/// An actuator: an input column, what happens to it, its gain.
#[derive(Debug)]
pub(crate) struct Line {
    pub(crate) input: usize,
    pub(crate) gain: usize,
    pub(crate) linear: bool,
    pub(crate) chain: InputChainSlots,
    /// The position loop of its firmware.
    pub(crate) servo: Option<Servo>,
}

/// A position loop: what a dead band leaves of the difference between an input and the coordinate
/// of a body, times the gain, within a limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Servo {
    pub(crate) body: usize,
    /// Half the width of its dead band.
    pub(crate) dead_band: Option<Gap>,
    /// Its largest force.
    pub(crate) limit: Option<Gap>,
}

/// Slots of what happens to an input before its gain, in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct InputChainSlots {
    pub(crate) delay: Option<usize>,
    pub(crate) play: Option<usize>,
    pub(crate) dead_zone: Option<usize>,
    pub(crate) curvature: Option<usize>,
    pub(crate) saturation: Option<usize>,
    pub(crate) lag: Option<usize>,
}

#[derive(Debug)]
pub(crate) struct Motor {
    pub(crate) body: usize,
    /// Index of a line.
    pub(crate) line: usize,
}

#[derive(Debug)]
pub(crate) struct Load {
    pub(crate) body: usize,
    pub(crate) motion: Motion,
    pub(crate) law: Law,
}

/// An end stop; its parameters from `slot` on are position, stiffness, damping, side.
#[derive(Debug)]
pub(crate) struct Stop {
    pub(crate) body: usize,
    pub(crate) slot: usize,
    pub(crate) switch: usize,
}

/// Friction that yields before it slips; its parameters from `slot` on are level and distance.
#[derive(Debug)]
pub(crate) struct Presliding {
    pub(crate) body: usize,
    pub(crate) slot: usize,
    /// Index of the internal state that is its share of the level.
    pub(crate) state: usize,
    /// Sign of the velocity.
    pub(crate) direction: usize,
}

/// Dry friction along one direction: a body's coordinate, or a tendon's path.
#[derive(Debug)]
pub(crate) struct Friction {
    /// (body, slot of its arm; none: 1).
    pub(crate) path: Vec<(usize, Option<usize>)>,
    /// The tendon whose path it is.
    pub(crate) along: Option<usize>,
    pub(crate) motion: Motion,
    pub(crate) laws: Vec<Law>,
    pub(crate) follows: Vec<Follow>,
    /// Levels that fall as they warm.
    pub(crate) warming: Vec<Warming>,
    /// It moves nothing: the motion of every body of its path is imposed.
    pub(crate) passive: bool,
}

impl Friction {
    /// The body, where it is one whole.
    pub(crate) fn body(&self) -> usize {
        self.path[0].0
    }
}

/// Friction that warms; its parameters from `slot` on are level, velocity and time constant.
#[derive(Debug)]
pub(crate) struct Warming {
    pub(crate) slot: usize,
    /// Index of the internal state that is its temperature.
    pub(crate) state: usize,
    /// Sign of the velocity.
    pub(crate) direction: usize,
}

/// Friction that follows a load.
#[derive(Debug)]
pub(crate) struct Follow {
    pub(crate) coefficient: usize,
    /// Arm of the one body of a tendon: the level acts over it.
    pub(crate) arm: Option<usize>,
    pub(crate) load: Followed,
    /// Index of the load.
    pub(crate) index: usize,
    /// Sign of the load.
    pub(crate) switch: usize,
}

/// Load that friction follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Followed {
    /// The tension of a tendon.
    Tension(usize),
    /// The force of the actuators at a body.
    Motors(usize),
    /// The sum of the spring and tendon forces at a body.
    Pulls(usize),
}

#[derive(Debug)]
pub(crate) struct Sensor {
    pub(crate) reads: Reads,
    pub(crate) gain: usize,
    pub(crate) offset: usize,
    pub(crate) curvature: Option<usize>,
    /// Slot of its time constant and its internal state.
    pub(crate) lag: Option<(usize, usize)>,
}

/// A row of zipping pouches.
#[derive(Debug)]
pub(crate) struct Hasel {
    /// (body, slot of its arm).
    pub(crate) path: Vec<(usize, usize)>,
    /// Actuators that charge it.
    pub(crate) lines: Vec<usize>,
    /// Index of the internal state that is its charge, C.
    pub(crate) charge: usize,
    pub(crate) pouches: f64,
    pub(crate) slack: usize,
    pub(crate) pouch_length: usize,
    pub(crate) width: usize,
    pub(crate) film_thickness: usize,
    pub(crate) permittivity: usize,
    pub(crate) fill_angle: usize,
    /// The first of the numbers that follow from it, behind all parameters.
    pub(crate) pouch: usize,
    pub(crate) capacitance: usize,
    pub(crate) resistance: usize,
    pub(crate) film_stiffness: usize,
}

/// A quantity whose sign or range selects the branch of a law. The branch stays put within a step,
/// which ends where the quantity leaves it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Switch {
    /// Tendon: 1 taut, 0 slack.
    Slack(usize),
    /// Spring: which side of its dead band, -1, 0, 1.
    SpringGap(usize),
    /// Tendon: which side of its dead band.
    TendonGap(usize),
    /// Stop: 0 away, 1 pressing, 2 inside and let go.
    Stop(usize),
    /// Body: sign of its velocity.
    Velocity(usize),
    /// Spring: sign of its rate.
    SpringRate(usize),
    /// Internal state: its sign.
    Internal(usize),
    /// Spring, and slot and internal state of its plastic branch: 0 elastic, 1 and -1 yielding.
    Yield {
        spring: usize,
        slot: usize,
        state: usize,
    },
    /// Line: which side of the dead band of its position loop the error is.
    LoopBand(usize),
    /// Line: at which limit its position loop is.
    LoopLimit(usize),
    /// Friction and which of its loads: the sign of the load.
    Load(usize, usize),
}

impl Topology {
    /// Some input acts later than it comes.
    pub(crate) fn has_memory(&self) -> bool {
        let memory = |chain: &InputChainSlots| chain.delay.or(chain.play).or(chain.lag);
        self.lines.iter().any(|line| memory(&line.chain).is_some())
            || self.signals.iter().any(|signal| signal.lag.is_some())
    }

    /// True where the rates are affine in the state and the inputs, and few enough.
    pub(crate) fn is_linear(&self) -> bool {
        let straight = |law: &Law, motion: Motion| law.kind.straight(motion);
        let remembers = |memory: &Memory| matches!(memory, Memory::Creep { .. });
        self.frictions.is_empty()
            && self.switches.is_empty()
            && self.hasels.is_empty()
            && self.lagging.is_empty()
            && !self.shaped
            && !self.rates_vary
            && self.imposed.is_empty()
            && self.depending.is_empty()
            && (self.loads.iter()).all(|load| straight(&load.law, load.motion))
            && (self.springs.iter()).all(|spring| {
                spring.laws.iter().all(|law| straight(law, spring.motion))
                    && spring.memory.iter().all(remembers)
            })
            && 2 * self.bodies.len() + self.internal.len() <= MOST_STATES
    }

    /// The recording imposes the motion of a body.
    pub(crate) fn is_imposed(&self, body: usize) -> bool {
        self.imposed.contains(&body)
    }

    /// Place of a body in the rig's file, for a body that cannot be simulated.
    pub(crate) fn place(&self, body: usize) -> BodyPlace {
        BodyPlace {
            file: self.file.clone(),
            line: self.bodies[body].line,
            body: self.names[body].clone(),
        }
    }
}

impl Switch {
    /// The central path has no branches there.
    pub(crate) fn smoothed(self) -> bool {
        matches!(self, Self::Slack(_) | Self::Stop(_))
    }
}
