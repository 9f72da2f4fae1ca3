//! The geometry of a rig as indices and slots: arms that follow from where a line runs, and what sensors
//! read of shapes (docs/geometry.md).

use super::compile::Slots;
use super::topology::{State, Topology};
use crate::effects::Sign;
use crate::geometry::{Pose, Vector, chain, dipole, plate, sum};
use crate::rig::{Axis, Rig, Route, Shape};
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
}

impl Derived {
    fn value<S: Scalar>(self, values: &[S]) -> S {
        match self {
            Self::AboutX { radius, angle } => values[radius] * values[angle].sin(),
            Self::AboutY { radius, angle } => -(values[radius] * values[angle].cos()),
            Self::One => S::constant(1.0),
            Self::Same(slot) => values[slot],
            Self::Minus(slot) => -values[slot],
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
}

#[derive(Debug)]
struct ChainSlots {
    first_body: usize,
    segments: usize,
    length: usize,
}

#[derive(Debug)]
struct PlateSlots {
    first_body: usize,
    height: usize,
    tip: usize,
}

#[derive(Debug)]
struct WaveguideSlots {
    chain: usize,
    radius: usize,
    angle: usize,
    loss: usize,
    /// What part of each segment it runs along, 0 to 1.
    cover: Vec<f64>,
    /// What part of the chain it runs along.
    part: f64,
}

#[derive(Debug)]
struct MagnetSlots {
    plate: usize,
    at: [f64; 3],
    axis: [f64; 3],
    moment: usize,
}

/// The coordinates of a path whose arms are still to be found: body and arm.
type Arms = Vec<(usize, Derived)>;

fn arms(rig: &Rig, slots: &mut Slots, line: &str, routes: &[Route]) -> Arms {
    let mut arms = Arms::new();
    for route in routes {
        match route {
            Route::Chain {
                chain,
                radius,
                angle,
                segments,
            } => {
                let chain = &rig.geometry.chains[*chain];
                let mut add =
                    |key, unit, value| slots.add_as(&[line, key, &chain.name], unit, value);
                let radius = add("radius", "m", radius);
                let angle = add("angle", "rad", angle);
                for segment in 0..*segments {
                    let body = chain.first_body + 2 * segment;
                    arms.push((body, Derived::AboutX { radius, angle }));
                    arms.push((body + 1, Derived::AboutY { radius, angle }));
                }
            }
            Route::Plate { plate, x, y } => {
                let plate = &rig.geometry.plates[*plate];
                let mut add = |key, value| slots.add_as(&[line, key, &plate.name], "m", value);
                let (x, y) = (add("x", x), add("y", y));
                arms.push((plate.first_body, Derived::One));
                arms.push((plate.first_body + 1, Derived::Same(y)));
                arms.push((plate.first_body + 2, Derived::Minus(x)));
            }
        }
    }
    arms
}

/// What part of segment `k` of `segments` the span covers.
fn cover(k: usize, segments: usize, [from, to]: [f64; 2]) -> f64 {
    let n = segments as f64;
    let (near, far) = (k as f64, (k + 1) as f64);
    (far.min(to * n) - near.max(from * n)).max(0.0)
}

/// Adds the geometry to a topology that has everything else; the last to add slots, since what is
/// derived stands behind all parameters.
pub(super) fn add(rig: &Rig, slots: &mut Slots, topology: &mut Topology) {
    let geometry = &rig.geometry;
    let mut shapes = Shapes::default();
    for chain in &geometry.chains {
        shapes.chains.push(ChainSlots {
            first_body: chain.first_body,
            segments: chain.segments,
            length: slots.add_signed(&[&chain.name, "length"], "m", Sign::Positive, &chain.length),
        });
    }
    for plate in &geometry.plates {
        shapes.plates.push(PlateSlots {
            first_body: plate.first_body,
            height: slots.add_as(&[&plate.name, "height"], "m", &plate.height),
            tip: slots.add_as(&[&plate.name, "tip"], "m", &plate.tip),
        });
    }
    for fibre in &geometry.waveguides {
        let segments = geometry.chains[fibre.chain].segments;
        let name = fibre.name.as_str();
        let radius = &fibre.radius;
        shapes.waveguides.push(WaveguideSlots {
            chain: fibre.chain,
            radius: slots.add_signed(&[name, "radius"], "m", Sign::Positive, radius),
            angle: slots.add_as(&[name, "angle"], "rad", &fibre.angle),
            loss: slots.add_as(&[name, "loss"], "1", &fibre.loss),
            cover: (0..segments)
                .map(|k| cover(k, segments, fibre.span))
                .collect(),
            part: fibre.span[1] - fibre.span[0],
        });
    }
    for magnet in &geometry.magnets {
        shapes.magnets.push(MagnetSlots {
            plate: magnet.plate,
            at: magnet.at,
            axis: magnet.axis,
            moment: slots.add_as(&[&magnet.name, "moment"], "A m^2", &magnet.moment),
        });
    }
    shapes.magnetometers = geometry.magnetometers.iter().map(|m| m.at).collect();

    let lines: Vec<Arms> = (rig.tendons.iter())
        .map(|tendon| arms(rig, slots, &tendon.name, &tendon.routes))
        .collect();
    for (tendon, arms) in topology.tendons.iter_mut().zip(lines) {
        for (body, derived) in arms {
            let slot = slots.len() + shapes.derived.len();
            shapes.derived.push(derived);
            tendon.path.push((body, slot));
        }
    }
    topology.shapes = shapes;
}

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
        state: &'a State<S>,
    ) -> impl ExactSizeIterator<Item = [S; 2]> + 'a {
        let first = self.chains[chain].first_body;
        let segments = self.chains[chain].segments;
        (0..segments).map(move |k| [state.q[first + 2 * k], state.q[first + 2 * k + 1]])
    }

    fn plate<S: Scalar>(&self, plate: usize, values: &[S], state: &State<S>) -> Pose<S> {
        let plate = &self.plates[plate];
        let [z, roll, pitch] = std::array::from_fn(|k| state.q[plate.first_body + k]);
        plate::pose(values[plate.height], z, roll, pitch)
    }

    /// What a sensor reads of a shape.
    pub(crate) fn read<S: Scalar>(&self, shape: Shape, values: &[S], state: &State<S>) -> S {
        match shape {
            Shape::ChainTip(chain, axis) => {
                let length = values[self.chains[chain].length];
                component(chain::tip(length, self.bends(chain, state)).origin, axis)
            }
            Shape::PlateTip(plate, axis) => {
                let tip = [S::ZERO, S::ZERO, values[self.plates[plate].tip]];
                component(self.plate(plate, values, state).point(tip), axis)
            }
            Shape::Light(waveguide) => self.light(waveguide, values, state),
            Shape::Field(magnetometer, axis) => {
                component(self.field(magnetometer, values, state), axis)
            }
        }
    }

    /// Light that comes through a fibre, 1 where it is not stretched (eq. 3).
    fn light<S: Scalar>(&self, waveguide: usize, values: &[S], state: &State<S>) -> S {
        let fibre = &self.waveguides[waveguide];
        let (sin, cos) = (values[fibre.angle].sin(), values[fibre.angle].cos());
        let mut stretch = S::ZERO;
        for ([x, y], &cover) in self.bends(fibre.chain, state).zip(&fibre.cover) {
            stretch += (sin * x - cos * y) * cover;
        }
        let length = values[self.chains[fibre.chain].length] * fibre.part;
        let strain = values[fibre.radius] * stretch / length;
        (-(values[fibre.loss] * strain)).exp()
    }

    /// The field of all magnets at a magnetometer, T (eq. 6).
    fn field<S: Scalar>(&self, meter: usize, values: &[S], state: &State<S>) -> Vector<S> {
        let meter = self.magnetometers[meter].map(S::constant);
        let mut total = [S::ZERO; 3];
        for magnet in &self.magnets {
            let pose = self.plate(magnet.plate, values, state);
            let at = pose.point(magnet.at.map(S::constant));
            let moment = pose.direction(magnet.axis.map(|a| values[magnet.moment] * a));
            let r: Vector<S> = std::array::from_fn(|i| meter[i] - at[i]);
            total = sum(total, dipole::field(moment, r));
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::cover;

    #[test]
    fn a_span_covers_its_segments() {
        let covers = |span| (0..3).map(|k| cover(k, 3, span)).collect::<Vec<_>>();
        assert_eq!(covers([0.0, 1.0]), [1.0, 1.0, 1.0]);
        assert_eq!(covers([0.5, 1.0]), [0.0, 0.5, 1.0]);
        assert!(
            covers([0.4, 0.6])
                .iter()
                .zip([0.0, 0.6, 0.0])
                .all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-12)
        );
    }
}
