//! The geometry of a rig as indices and slots: arms that follow from where a line runs, and what
//! sensors read of shapes (docs/explanation/geometry.md).

mod compile;
mod outline;

pub(super) use compile::add;
pub use outline::{Outline, Role};

use crate::geometry::zip::Pouch;
use crate::geometry::{Pose, Vector, chain, dipole, plate, sum};
use crate::rig::{Axis, Shape};
use crate::scalar::Scalar;

/// A number that follows from parameters and stands in a slot behind them all.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Derived {
    /// `radius sin(angle)`: the arm of a line about a chain's x (eq. 2a).
    AboutX { radius: usize, angle: usize },
    /// `-radius cos(angle)`: its arm about y.
    AboutY { radius: usize, angle: usize },
    /// 1: the arm of a line along a plate's z (eq. 5).
    One,
    /// A slot as it is: the arm about a plate's roll.
    Same(usize),
    /// A slot with its sign turned: the arm about a plate's pitch.
    Minus(usize),
    /// One of the numbers that the rest angle of a pouch fixes.
    Pouch { rest: usize, number: usize },
}

impl Derived {
    fn value<S: Scalar>(self, values: &[S]) -> S {
        match self {
            Self::AboutX { radius, angle } => values[radius] * values[angle].sin(),
            Self::AboutY { radius, angle } => -(values[radius] * values[angle].cos()),
            Self::One => S::constant(1.0),
            Self::Same(slot) => values[slot],
            Self::Minus(slot) => -values[slot],
            Self::Pouch { rest, number } => Pouch::new(values[rest]).numbers()[number],
        }
    }
}

#[derive(Debug, Default)]
pub(crate) struct Shapes {
    pub(crate) derived: Vec<Derived>,
    chains: Vec<ChainSlots>,
    plates: Vec<PlateSlots>,
    waveguides: Vec<WaveguideSlots>,
    magnets: Vec<MagnetSlots>,
    magnetometers: Vec<[f64; 3]>,
    lines: Vec<LineSlots>,
}

#[derive(Debug)]
struct ChainSlots {
    name: String,
    first_body: usize,
    segments: usize,
    length: usize,
}

#[derive(Debug)]
struct PlateSlots {
    name: String,
    first_body: usize,
    height: usize,
    tip: usize,
}

#[derive(Debug)]
struct WaveguideSlots {
    name: String,
    span: [f64; 2],
    chain: usize,
    radius: usize,
    angle: usize,
    loss: usize,
    /// Part of each segment that it runs along, 0 to 1.
    cover: Vec<f64>,
    /// Part of the chain that it runs along.
    part: f64,
}

#[derive(Debug)]
struct MagnetSlots {
    name: String,
    plate: usize,
    at: [f64; 3],
    axis: [f64; 3],
    moment: usize,
}

/// Course of a line, for a drawing.
#[derive(Debug)]
struct LineSlots {
    name: String,
    role: Role,
    course: Course,
}

#[derive(Debug)]
enum Course {
    /// Chain, radius, angle, segments.
    Chain(usize, usize, usize, usize),
    /// Plate, x, y.
    Plate(usize, usize, usize),
}

/// The last reading, and the vector that it is a component of.
pub(crate) type Seen<S> = Option<(Shape, Vector<S>)>;

fn component<S: Copy>(vector: Vector<S>, axis: Axis) -> S {
    match axis {
        Axis::X => vector[0],
        Axis::Y => vector[1],
        Axis::Z => vector[2],
    }
}

impl Shapes {
    /// The parameters, and behind them what follows from them.
    pub(crate) fn complete<S: Scalar>(&self, values: &[S]) -> Vec<S> {
        let derived = self.derived.iter().map(|derived| derived.value(values));
        values.iter().copied().chain(derived).collect()
    }

    fn bends<'a, S: Scalar>(
        &self,
        chain: usize,
        q: &'a [S],
    ) -> impl ExactSizeIterator<Item = [S; 2]> + 'a {
        let first = self.chains[chain].first_body;
        let segments = self.chains[chain].segments;
        (0..segments).map(move |k| [q[first + 2 * k], q[first + 2 * k + 1]])
    }

    fn plate<S: Scalar>(&self, plate: usize, values: &[S], q: &[S]) -> Pose<S> {
        let plate = &self.plates[plate];
        let [z, roll, pitch] = std::array::from_fn(|k| q[plate.first_body + k]);
        plate::pose(values[plate.height], z, roll, pitch)
    }

    /// Reading of a shape; `seen` is the vector of the sensor before, in the same state.
    pub(crate) fn read<S: Scalar>(
        &self,
        shape: Shape,
        values: &[S],
        q: &[S],
        seen: &mut Seen<S>,
    ) -> S {
        let axis = match shape {
            Shape::ChainTip(_, axis) | Shape::PlateTip(_, axis) | Shape::Field(_, axis) => axis,
            Shape::Light(waveguide) => return self.light(waveguide, values, q),
        };
        if let Some((known, vector)) = seen
            && known.beside(shape)
        {
            return component(*vector, axis);
        }
        let vector = match shape {
            Shape::ChainTip(chain, _) => {
                let length = values[self.chains[chain].length];
                chain::tip(length, self.bends(chain, q)).origin
            }
            Shape::PlateTip(plate, _) => {
                let tip = [S::ZERO, S::ZERO, values[self.plates[plate].tip]];
                self.plate(plate, values, q).point(tip)
            }
            Shape::Field(magnetometer, _) => self.field(magnetometer, values, q),
            Shape::Light(_) => [S::ZERO; 3],
        };
        *seen = Some((shape, vector));
        component(vector, axis)
    }

    /// Light that comes through a fibre, 1 where it is not stretched (eq. 3).
    fn light<S: Scalar>(&self, waveguide: usize, values: &[S], q: &[S]) -> S {
        let fibre = &self.waveguides[waveguide];
        let (sin, cos) = (values[fibre.angle].sin(), values[fibre.angle].cos());
        let mut stretch = S::ZERO;
        for ([x, y], &cover) in self.bends(fibre.chain, q).zip(&fibre.cover) {
            stretch += (sin * x - cos * y) * cover;
        }
        let length = values[self.chains[fibre.chain].length] * fibre.part;
        let strain = values[fibre.radius] * stretch / length;
        (-(values[fibre.loss] * strain)).exp()
    }

    /// The field of all magnets at a magnetometer, T (eq. 6).
    fn field<S: Scalar>(&self, meter: usize, values: &[S], q: &[S]) -> Vector<S> {
        let meter = self.magnetometers[meter].map(S::constant);
        let mut total = [S::ZERO; 3];
        for magnet in &self.magnets {
            let pose = self.plate(magnet.plate, values, q);
            let at = pose.point(magnet.at.map(S::constant));
            let moment = pose.direction(magnet.axis.map(|a| values[magnet.moment] * a));
            let r: Vector<S> = std::array::from_fn(|i| meter[i] - at[i]);
            total = sum(total, dipole::field(moment, r));
        }
        total
    }
}
