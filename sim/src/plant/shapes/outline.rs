//! Outlines of a rig with a shape: lines in space, for drawings.

use super::{Course, Shapes};
use crate::error::SimulationError;
use crate::geometry::{Pose, chain};
use crate::math;
use crate::plant::Plant;

/// One line, or one point, in space.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The component that it belongs to; empty where none is drawn by name.
    pub name: String,
    /// Its meaning.
    pub role: Role,
    /// m; a magnet and a magnetometer are one point.
    pub points: Vec<[f64; 3]>,
}

/// Meaning of an [`Outline`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The middle line of a chain.
    Chain,
    /// An optical fibre.
    Waveguide,
    /// The rim of a plate.
    Plate,
    /// From the middle of a plate to its tip.
    Tip,
    /// A tendon along a chain or up to a plate.
    Tendon,
    /// A HASEL actuator.
    Hasel,
    /// A magnet.
    Magnet,
    /// A field sensor.
    Magnetometer,
}

impl Plant {
    /// Outlines of a rig with chains or plates in a state; empty for any other. The outlines of one
    /// plant come in the same order, with as many points, in every state.
    ///
    /// # Errors
    /// [`SimulationError::Shape`].
    pub fn outlines(&self, values: &[f64], state: &[f64]) -> Result<Vec<Outline>, SimulationError> {
        self.expect("parameter values", self.parameters().len(), values.len())?;
        self.expect("state", self.state_len(), state.len())?;
        Ok(self.topology.shapes.outlines(values, state))
    }
}

/// Points along each segment of a chain in a drawing.
const POINTS: usize = 8;

impl Shapes {
    /// All outlines, from back to front.
    fn outlines(&self, values: &[f64], q: &[f64]) -> Vec<Outline> {
        let mut outlines = Vec::new();
        let mut draw = |name: &str, role, points| {
            outlines.push(Outline {
                name: name.to_owned(),
                role,
                points,
            });
        };
        for (index, chain) in self.chains.iter().enumerate() {
            let along = self.along(index, values, q, [0.0, 1.0], [0.0; 2]);
            draw(&chain.name, Role::Chain, along);
        }
        for fibre in &self.waveguides {
            let [radius, angle] = [values[fibre.radius], values[fibre.angle]];
            let beside = [radius * math::cos(angle), radius * math::sin(angle)];
            let along = self.along(fibre.chain, values, q, fibre.span, beside);
            draw(&fibre.name, Role::Waveguide, along);
        }
        for (index, plate) in self.plates.iter().enumerate() {
            let pose = self.plate(index, values, q);
            let reach = self.reach(index, values);
            let around = (0..=PLATE_POINTS).map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / PLATE_POINTS as f64;
                pose.point([reach * math::cos(angle), reach * math::sin(angle), 0.0])
            });
            draw(&plate.name, Role::Plate, around.collect());
            let tip = pose.point([0.0, 0.0, values[plate.tip]]);
            draw(&plate.name, Role::Tip, vec![pose.origin, tip]);
        }
        for line in &self.lines {
            let points = match line.course {
                Course::Chain(chain, radius, angle, segments) => {
                    let (radius, angle) = (values[radius], values[angle]);
                    let beside = [radius * math::cos(angle), radius * math::sin(angle)];
                    let end = segments as f64 / self.chains[chain].segments as f64;
                    self.along(chain, values, q, [0.0, end], beside)
                }
                Course::Plate(plate, x, y) => {
                    let (x, y) = (values[x], values[y]);
                    vec![[x, y, 0.0], self.plate(plate, values, q).point([x, y, 0.0])]
                }
            };
            draw(&line.name, line.role, points);
        }
        for magnet in &self.magnets {
            let at = self.plate(magnet.plate, values, q).point(magnet.at);
            draw(&magnet.name, Role::Magnet, vec![at]);
        }
        for at in &self.magnetometers {
            draw("", Role::Magnetometer, vec![*at]);
        }
        outlines
    }

    /// Points along a chain, or beside its middle line, over a span of its length.
    fn along(
        &self,
        chain: usize,
        values: &[f64],
        q: &[f64],
        [from, to]: [f64; 2],
        [x, y]: [f64; 2],
    ) -> Vec<[f64; 3]> {
        let count = self.chains[chain].segments;
        let length = values[self.chains[chain].length] / count as f64;
        let (from, to) = (from * count as f64, to * count as f64);
        let mut base = Pose::world();
        let mut points = Vec::new();
        for (k, bend) in self.bends(chain, q).enumerate() {
            for part in 0..=POINTS {
                let part = part as f64 / POINTS as f64;
                let at = k as f64 + part;
                // The end of one segment is the beginning of the next.
                if (part == 0.0 && k > 0) || at < from - 1e-9 || at > to + 1e-9 {
                    continue;
                }
                let here = chain::segment(length * part, bend.map(|b| b * part));
                points.push(base.then(&here).point([x, y, 0.0]));
            }
            base = base.then(&chain::segment(length, bend));
        }
        points
    }

    /// Radius of a plate in a drawing: it holds what is fixed to it.
    fn reach(&self, plate: usize, values: &[f64]) -> f64 {
        let magnets = self.magnets.iter().filter(|m| m.plate == plate);
        let magnets = magnets.map(|m| (m.at[0], m.at[1]));
        let lines = self.lines.iter().filter_map(|line| match line.course {
            Course::Plate(on, x, y) if on == plate => Some((values[x], values[y])),
            _ => None,
        });
        let farthest = magnets.chain(lines).map(|(x, y)| math::sqrt(x * x + y * y));
        1.1 * farthest.fold(0.02, f64::max)
    }
}

/// Corners of a plate in a drawing.
const PLATE_POINTS: usize = 24;
