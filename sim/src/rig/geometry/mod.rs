//! Geometry in a rig file: what has a shape, and what reads it. A chain or a plate is written as
//! one component and becomes bodies (with springs and dampers), so that everything that can sit at
//! a body can sit at a segment too.

mod chain;
mod hasel;
mod magnet;
mod plate;
mod reads;
mod route;
mod waveguide;

use super::Value;
use super::names::Section;
pub(super) use chain::{expand as expand_chain, generated as chain_names};
pub(super) use hasel::{read_hasel, read_path};
pub(super) use magnet::{read_magnet, read_magnetometer};
pub(super) use plate::{expand as expand_plate, generated as plate_names};
pub(super) use reads::{Reading, split};
use route::{read_route, same_place};
pub(super) use waveguide::read_waveguide;

/// The named tables of geometry.
pub(super) const SECTIONS: &[Section] = &[
    chain::SECTION,
    plate::SECTION,
    waveguide::SECTION,
    magnet::MAGNET,
    magnet::MAGNETOMETER,
    hasel::SECTION,
];

/// Everything of a rig that has a shape.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Soft segments that bend about two axes.
    pub chains: Vec<Chain>,
    /// Plates that rise, roll and pitch.
    pub plates: Vec<Plate>,
    /// Fibres that lose light when stretched.
    pub waveguides: Vec<Waveguide>,
    /// Small magnets on plates.
    pub magnets: Vec<Magnet>,
    /// Three-axis field sensors that do not move.
    pub magnetometers: Vec<Magnetometer>,
    /// Rows of zipping pouches.
    pub hasels: Vec<Hasel>,
}

/// Segments of constant curvature end to end, each bending about two axes
/// (docs/explanation/geometry.md, eq. 1).
#[derive(Clone, Debug)]
pub struct Chain {
    /// Unique in the file.
    pub name: String,
    /// Number of segments.
    pub segments: usize,
    /// Of the whole middle line, m.
    pub length: Value,
    /// Index of the body `NAME.x1`; `NAME.y1`, `NAME.x2`, ... follow.
    pub first_body: usize,
}

/// A plate that rises, rolls and pitches (docs/explanation/geometry.md, eq. 4).
#[derive(Clone, Debug)]
pub struct Plate {
    /// Unique in the file.
    pub name: String,
    /// Of its middle above the origin at rest, m.
    pub height: Value,
    /// Of its tip above its middle, m.
    pub tip: Value,
    /// Index of the body `NAME.z`; `NAME.roll` and `NAME.pitch` follow.
    pub first_body: usize,
}

/// A fibre along a chain that loses light when stretched (docs/explanation/geometry.md, eq. 3).
#[derive(Clone, Debug)]
pub struct Waveguide {
    /// Unique in the file.
    pub name: String,
    /// Index of the chain.
    pub chain: usize,
    /// From the middle line, m.
    pub radius: Value,
    /// About the middle line, from x towards y, rad.
    pub angle: Value,
    /// Beginning and end, as fractions of the chain's length.
    pub span: [f64; 2],
    /// Loss of light: -d ln(light) / d strain.
    pub loss: Value,
}

/// A small magnet on a plate.
#[derive(Clone, Debug)]
pub struct Magnet {
    /// Unique in the file.
    pub name: String,
    /// Index of the plate.
    pub plate: usize,
    /// Position on the plate, m.
    pub at: [f64; 3],
    /// Unit vector to its north on the plate.
    pub axis: [f64; 3],
    /// A m^2.
    pub moment: Value,
}

/// A three-axis field sensor that does not move.
#[derive(Clone, Debug)]
pub struct Magnetometer {
    /// Unique in the file.
    pub name: String,
    /// Position, m.
    pub at: [f64; 3],
}

/// A row of zipping pouches that pulls along its path (docs/explanation/geometry.md, eq. 9).
#[derive(Clone, Debug)]
pub struct Hasel {
    /// Unique in the file.
    pub name: String,
    /// (index of the body, arm in m or +-1).
    pub path: Vec<(usize, Value)>,
    /// Chains that it follows and plates that it holds.
    pub routes: Vec<Route>,
    /// Distance from stretched out with its bodies at 0, m.
    pub slack: Value,
    /// Number of pouches in the row.
    pub pouches: usize,
    /// Film of one pouch from end to end, m.
    pub pouch_length: Value,
    /// Of the electrodes, m.
    pub width: Value,
    /// Of one film, m.
    pub film_thickness: Value,
    /// Relative, of the film.
    pub permittivity: Value,
    /// Half the angle of the oil's arcs at rest, rad.
    pub fill_angle: Value,
    /// Beside the film that has zipped, F.
    pub capacitance: Value,
    /// Between the command and the electrodes, ohm.
    pub resistance: Value,
    /// Once stretched out, N/m.
    pub film_stiffness: Value,
}

/// Reading of a HASEL actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HaselReading {
    /// Between its electrodes, V.
    Voltage,
    /// Contraction from stretched out, m.
    Stroke,
}

/// A tendon (or another line) that follows a chain or holds a plate, as one entry of its path; it
/// becomes an arm at each coordinate.
#[derive(Clone, Debug)]
pub enum Route {
    /// Along the first segments of a chain, at a radius and an angle (eq. 2a).
    Chain {
        /// Index of the chain.
        chain: usize,
        /// From the middle line, m.
        radius: Value,
        /// About the middle line, from x towards y, rad.
        angle: Value,
        /// Number of segments from the base that it runs along.
        segments: usize,
    },
    /// Up to a point of a plate (eq. 5).
    Plate {
        /// Index of the plate.
        plate: usize,
        /// Position on the plate, m.
        x: Value,
        /// Position on the plate, m.
        y: Value,
    },
}

/// An axis of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Across.
    X,
    /// Across, at right angles to x.
    Y,
    /// Along a chain at rest; up from a plate.
    Z,
}

/// Reading of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// `CHAIN.tip.x`: where the end of a chain is, m.
    ChainTip(usize, Axis),
    /// `PLATE.tip.x`: where the tip of a plate is, m.
    PlateTip(usize, Axis),
    /// `WAVEGUIDE.light`: what comes through, 1 where it is not stretched.
    Light(usize),
    /// `MAGNETOMETER.x`: the field of all magnets, T.
    Field(usize, Axis),
}

impl Shape {
    /// Both are components of one vector.
    pub fn beside(self, other: Self) -> bool {
        match (self, other) {
            (Self::ChainTip(a, _), Self::ChainTip(b, _))
            | (Self::PlateTip(a, _), Self::PlateTip(b, _))
            | (Self::Field(a, _), Self::Field(b, _)) => a == b,
            _ => false,
        }
    }

    /// Unit of the reading.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::ChainTip(..) | Self::PlateTip(..) => "m",
            Self::Light(_) => "1",
            Self::Field(..) => "T",
        }
    }
}
