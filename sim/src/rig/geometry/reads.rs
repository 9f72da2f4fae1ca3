//! Readings of each kind of component, by name.

use super::{Axis, HaselReading, Shape};
use crate::rig::Reads;
use crate::rig::names::{Component, Names};

/// A reading by its name, and the components that have it.
pub(in crate::rig) struct Reading {
    /// After the component's name and a dot.
    pub(in crate::rig) name: &'static str,
    /// Whose it is, for help.
    pub(in crate::rig) list: &'static str,
    /// The reading of a component, if it has one of that name.
    pub(in crate::rig) of: fn(Component) -> Option<Reads>,
}

macro_rules! reading {
    ($name:literal, $list:literal, $($component:pat => $reads:expr),+) => {
        Reading {
            name: $name,
            list: $list,
            of: |component| match component {
                $($component => Some($reads),)+
                _ => None,
            },
        }
    };
}

macro_rules! along {
    ($tip:literal, $own:literal, $axis:expr) => {
        [
            reading!($tip, "chains and plates",
                Component::Chain(c) => Reads::Shape(Shape::ChainTip(c, $axis)),
                Component::Plate(p) => Reads::Shape(Shape::PlateTip(p, $axis))),
            reading!($own, "magnetometers",
                Component::Magnetometer(m) => Reads::Shape(Shape::Field(m, $axis))),
        ]
    };
}

const BODIES: [Reading; 3] = [
    reading!("position", "bodies", Component::Body(body) => Reads::Position(body)),
    reading!("velocity", "bodies", Component::Body(body) => Reads::Velocity(body)),
    reading!("effort", "bodies and actuators",
        Component::Body(body) => Reads::Effort(body),
        Component::Actuator(actuator) => Reads::ActuatorEffort(actuator)),
];
const TENDONS: [Reading; 1] =
    [reading!("tension", "tendons", Component::Tendon(tendon) => Reads::Tension(tendon))];
const X: [Reading; 2] = along!("tip.x", "x", Axis::X);
const Y: [Reading; 2] = along!("tip.y", "y", Axis::Y);
const Z: [Reading; 2] = along!("tip.z", "z", Axis::Z);
const LIGHT: [Reading; 1] =
    [reading!("light", "waveguides", Component::Waveguide(w) => Reads::Shape(Shape::Light(w)))];

const HASELS: [Reading; 2] = [
    reading!("voltage", "HASEL actuators",
        Component::Hasel(h) => Reads::Hasel(h, HaselReading::Voltage)),
    reading!("stroke", "HASEL actuators",
        Component::Hasel(h) => Reads::Hasel(h, HaselReading::Stroke)),
];

impl Reading {
    /// Every reading there is.
    pub(in crate::rig) fn all() -> impl Iterator<Item = &'static Self> {
        [&BODIES[..], &TENDONS, &X, &Y, &Z, &LIGHT, &HASELS]
            .into_iter()
            .flatten()
    }
}

/// Cuts `spine.x1.position` into the component's name and the reading: the longest name that the
/// file knows. Where it knows none, at the first dot that leaves a reading, or else at the first.
pub(in crate::rig) fn split<'a>(text: &'a str, names: &Names) -> Option<(&'a str, &'a str)> {
    let cuts = || {
        let dots = text.match_indices('.').map(|(at, _)| at);
        dots.map(|at| (&text[..at], &text[at + 1..]))
    };
    let known = cuts().rfind(|(name, _)| names.get(name).is_some());
    let read = || cuts().find(|(_, reading)| Reading::all().any(|r| r.name == *reading));
    known.or_else(read).or_else(|| cuts().next())
}
