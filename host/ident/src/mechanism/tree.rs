//! Links and joints in the reference configuration, in coordinates of the world.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::document::Place;
use crate::error::{Error, Result};

/// Motion of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Along its axis.
    Slide,
    /// About its axis.
    Hinge,
    /// More than one coordinate, or one that follows another.
    Other(&'static str),
}

/// Mass, its centre and its moments about that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    /// kg.
    pub mass: f64,
    /// m.
    pub centre: Vector3<f64>,
    /// kg m^2, about the centre.
    pub moments: Matrix3<f64>,
}

impl Mass {
    /// Nothing.
    pub fn none() -> Self {
        Self {
            mass: 0.0,
            centre: Vector3::zeros(),
            moments: Matrix3::zeros(),
        }
    }

    /// Both together.
    pub fn with(self, other: Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            let moments = self.moments + other.moments;
            return Self { moments, ..self };
        }
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        let about = |part: Self| part.moments + point(part.mass, part.centre - centre);
        Self {
            mass,
            centre,
            moments: about(self) + about(other),
        }
    }

    /// As seen from where `pose` is a pose of its own coordinates.
    pub fn moved(self, pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            centre: (pose * nalgebra::Point3::from(self.centre)).coords,
            moments: turn * self.moments * turn.transpose(),
        }
    }

    /// Moment about an axis of unit length through a point.
    pub fn about(&self, axis: Vector3<f64>, through: Vector3<f64>) -> f64 {
        let moments = self.moments + point(self.mass, self.centre - through);
        axis.dot(&(moments * axis))
    }
}

/// Moments of a point mass.
fn point(mass: f64, at: Vector3<f64>) -> Matrix3<f64> {
    mass * (Matrix3::identity() * at.dot(&at) - at * at.transpose())
}

/// One joint, its own numbers in SI.
#[derive(Clone, Debug)]
pub struct Joint {
    pub name: String,
    pub place: Place,
    pub motion: Motion,
    /// Unit length, in the world.
    pub axis: Vector3<f64>,
    pub anchor: Vector3<f64>,
    /// Coordinate in the reference configuration.
    pub reference: f64,
    pub armature: f64,
    /// Linear, quadratic.
    pub damping: [f64; 2],
    pub friction: f64,
    /// Linear, quadratic, cubic.
    pub stiffness: [f64; 3],
    pub rest: f64,
    /// As the file and its default classes say them.
    pub attributes: Vec<(String, String)>,
}

impl Joint {
    /// Text of an attribute.
    pub fn said(&self, attribute: &str) -> Option<String> {
        let found = self.attributes.iter().find(|(key, _)| key == attribute)?;
        Some(found.1.clone())
    }
}

/// One rigid part.
#[derive(Clone, Debug)]
pub struct Link {
    pub parent: Option<usize>,
    /// In the world.
    pub mass: Mass,
    /// Joints between the parent and it, the parent's side first: places in [`Tree::joints`].
    pub joints: Vec<usize>,
}

/// A mechanism.
#[derive(Clone, Debug)]
pub struct Tree {
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    pub gravity: Vector3<f64>,
}

/// A joint's coordinate with all that moves with it.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// Place in [`Tree::joints`].
    pub joint: usize,
    /// Mass or moment of inertia, without the armature.
    pub inertia: f64,
    /// Amplitude and zero as a rig has them.
    pub weight: (f64, f64),
}

/// Less than this of what it is compared with is nothing.
const NOTHING: f64 = 1e-9;

impl Tree {
    /// The coordinates of the joints that move; the others are held at their reference.
    ///
    /// # Errors
    /// `File` for a moving joint that is no hinge and no slide, has no inertia, or moves another.
    pub fn coordinates(&self, moving: &[usize]) -> Result<Vec<Coordinate>> {
        // From a joint to those behind it: the order of links has parents first.
        let mut found = Vec::new();
        for &index in moving {
            let joint = &self.joints[index];
            if let Motion::Other(what) = joint.motion {
                let message = format!("joint `{}` is {what}, which no rig has", joint.name);
                return Err(at(joint, message).help(self.instead(moving, index)));
            }
            let carried = self.carried(index);
            let inertia = match joint.motion {
                Motion::Slide => carried.mass,
                _ => carried.about(joint.axis, joint.anchor),
            };
            if inertia + joint.armature <= 0.0 {
                let message = format!("nothing that joint `{}` moves has an inertia", joint.name);
                return Err(at(joint, message)
                    .help("give its body an `inertial`, or geoms with a mass or density"));
            }
            for &behind in moving.iter().filter(|k| self.is_before(index, **k)) {
                self.refuse_coupling(index, behind)
                    .map_err(|error| error.help(self.instead(moving, index)))?;
            }
            found.push(Coordinate {
                joint: index,
                inertia,
                weight: self.weight(joint, &carried),
            });
        }
        Ok(found)
    }

    fn instead(&self, moving: &[usize], index: usize) -> String {
        let plain = |k: &&usize| !matches!(self.joints[**k].motion, Motion::Other(_));
        let other = moving.iter().filter(plain).find(|k| **k != index);
        let name = &self.joints[*other.unwrap_or(&index)].name;
        format!("--joint {name} takes one joint and holds the others still")
    }

    /// All that moves with a joint.
    fn carried(&self, joint: usize) -> Mass {
        let links = self.links.iter().enumerate();
        links
            .filter(|(index, _)| self.path(*index).contains(&joint))
            .fold(Mass::none(), |all, (_, link)| all.with(link.mass))
    }

    /// Joints from the world to a link, the link's own last.
    fn path(&self, link: usize) -> Vec<usize> {
        let mut path = Vec::new();
        let mut at = Some(link);
        while let Some(link) = at {
            path.splice(0..0, self.links[link].joints.iter().copied());
            at = self.links[link].parent;
        }
        path
    }

    /// True where joint `one` carries joint `other`.
    fn is_before(&self, one: usize, other: usize) -> bool {
        (0..self.links.len()).any(|link| {
            let path = self.path(link);
            let place = |joint| path.iter().position(|j| *j == joint);
            matches!((place(one), place(other)), (Some(a), Some(b)) if a < b)
        })
    }

    /// Refuses a joint that carries another where their motions are not independent: the inertia
    /// matrix would not be diagonal and constant.
    fn refuse_coupling(&self, carrier: usize, other: usize) -> Result<()> {
        let (one, two) = (&self.joints[carrier], &self.joints[other]);
        let carried = self.carried(other);
        let independent = match (one.motion, two.motion) {
            (Motion::Slide, Motion::Slide) => {
                one.axis.dot(&two.axis).abs() < NOTHING || carried.mass == 0.0
            }
            (Motion::Slide, Motion::Hinge) => {
                // The centre of mass goes round in a plane; the slide must be normal to it, or the
                // centre on the axis.
                let arm = two.axis.cross(&(carried.centre - two.anchor));
                let size = (carried.about(two.axis, two.anchor) / carried.mass.max(1e-300)).sqrt();
                arm.norm() <= 1e-6 * size || one.axis.cross(&two.axis).norm() < NOTHING
            }
            _ => false,
        };
        if independent {
            return Ok(());
        }
        Err(at(
            two,
            format!(
                "joints `{}` (line {}) and `{}` move each other: the dynamics of a chain are no \
                 rig's, whose coordinates have an inertia each",
                one.name, one.place.line, two.name
            ),
        ))
    }

    /// Amplitude and zero of the weight on a joint.
    fn weight(&self, joint: &Joint, carried: &Mass) -> (f64, f64) {
        let normal = |v: Vector3<f64>| v - joint.axis * joint.axis.dot(&v);
        if joint.motion == Motion::Slide {
            return (-carried.mass * self.gravity.dot(&joint.axis), 0.0);
        }
        let arm = normal(carried.centre - joint.anchor);
        let pull = normal(self.gravity);
        let amplitude = carried.mass * arm.norm() * pull.norm();
        let size = carried.about(joint.axis, joint.anchor).sqrt() * carried.mass.sqrt();
        if amplitude <= NOTHING * size * self.gravity.norm() {
            return (0.0, 0.0);
        }
        // Angle about the axis from the arm to the pull.
        let angle = joint.axis.dot(&arm.cross(&pull)).atan2(arm.dot(&pull));
        (amplitude, angle + joint.reference)
    }
}

fn at(joint: &Joint, message: String) -> Error {
    Error::file(&joint.place.file, message).at(joint.place.line, 1)
}
