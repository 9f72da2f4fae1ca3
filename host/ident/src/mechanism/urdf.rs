//! URDF (wiki.ros.org/urdf/XML) as a tree of links and joints.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use super::document::Node;
use super::left_out;
use super::numbers::{direction, number, vector};
use super::tree::{Joint, Link, Mass, Motion, Tree};
use super::{Drive, Mechanism};
use crate::error::Result;

/// Links of one robot.
const MOST_LINKS: usize = 500;

/// # Errors
/// `File` for what is no URDF, for numbers that are none, for joints of links that are not there.
pub fn read(root: &Node) -> Result<Mechanism> {
    if root.tag != "robot" {
        let message = format!("the file begins with `{}`, not with `robot`", root.tag);
        return Err(root.error(message).help("MJCF is read with --mjcf"));
    }
    let left_out = left_out::list(root, left_out::URDF);
    let named = |node: &Node| node.get("name").unwrap_or_default().to_owned();
    let links: BTreeMap<String, &Node> = root.all("link").map(|n| (named(n), n)).collect();
    if links.len() > MOST_LINKS {
        return Err(root.error(format!("more than {MOST_LINKS} links")));
    }
    let mut reader = Reader {
        links: &links,
        joints: root.all("joint").collect(),
        tree: Tree {
            links: Vec::new(),
            joints: Vec::new(),
            gravity: Vector3::new(0.0, 0.0, -9.81),
        },
        drives: Vec::new(),
        placed: Vec::new(),
    };
    let mut children = Vec::new();
    for joint in &reader.joints {
        for side in ["parent", "child"] {
            let name = reader.end(joint, side)?;
            if !links.contains_key(&name) {
                return Err(joint.error(format!("{} has no link `{name}`", joint.called())));
            }
            if side == "child" {
                children.push(name);
            }
        }
    }
    for name in links.keys().filter(|name| !children.contains(name)) {
        reader.link(name, &Isometry3::identity(), None, Vec::new())?;
    }
    if let Some((_, node)) = links.iter().find(|(name, _)| !reader.placed.contains(name)) {
        return Err(node.error(format!("{} hangs on itself", node.called())));
    }
    Ok(Mechanism {
        name: root.get("name").unwrap_or("robot").to_owned(),
        tree: reader.tree,
        drives: reader.drives,
        readings: Vec::new(),
        cables: Vec::new(),
        left_out,
        degrees: false,
    })
}

struct Reader<'a> {
    links: &'a BTreeMap<String, &'a Node>,
    joints: Vec<&'a Node>,
    tree: Tree,
    drives: Vec<Drive>,
    placed: Vec<String>,
}

impl Reader<'_> {
    fn end(&self, joint: &Node, side: &str) -> Result<String> {
        let name = joint.first(side).and_then(|node| node.get("link"));
        let name = name.map(str::to_owned);
        name.ok_or_else(|| joint.error(format!("{} has no `{side}`", joint.called())))
    }

    fn link(
        &mut self,
        name: &str,
        pose: &Isometry3<f64>,
        parent: Option<usize>,
        joints: Vec<usize>,
    ) -> Result<()> {
        let node = self.links[name];
        // A link with two parents would come twice, and a ring for ever.
        if self.placed.iter().any(|placed| placed == name) {
            return Err(node.error(format!("{} has two parents", node.called())));
        }
        self.placed.push(name.to_owned());
        let mass = match node.first("inertial") {
            Some(inertial) => inertia(inertial)?.moved(&(pose * origin(inertial)?)),
            None => Mass::none(),
        };
        let link = self.tree.links.len();
        self.tree.links.push(Link {
            parent,
            mass,
            joints,
        });
        for joint in self.joints.clone() {
            if self.end(joint, "parent")? != name {
                continue;
            }
            let pose = pose * origin(joint)?;
            let own = self.joint(joint, &pose)?;
            let child = self.end(joint, "child")?;
            self.link(&child, &pose, Some(link), own.into_iter().collect())?;
        }
        Ok(())
    }

    /// The joint's place in the tree; `None` for a fixed one.
    fn joint(&mut self, node: &Node, pose: &Isometry3<f64>) -> Result<Option<usize>> {
        let motion = match node.get("type") {
            Some("fixed") => return Ok(None),
            _ if node.first("mimic").is_some() => Motion::Other("one that follows another"),
            Some("revolute" | "continuous") => Motion::Hinge,
            Some("prismatic") => Motion::Slide,
            Some("floating") => Motion::Other("floating"),
            Some("planar") => Motion::Other("planar"),
            other => {
                let kind = other.unwrap_or("none");
                return Err(node.error(format!("{} is of type `{kind}`", node.called())));
            }
        };
        let axis = match node.first("axis") {
            Some(axis) => direction(axis, "xyz", axis.get("xyz"))?,
            None => None,
        };
        let number_in = |tag: &str, key: &str| match node.first(tag) {
            Some(inner) => number(inner, key, inner.get(key)),
            None => Ok(None),
        };
        let name = node.get("name").unwrap_or_default().to_owned();
        let index = self.tree.joints.len();
        self.tree.joints.push(Joint {
            name: name.clone(),
            place: node.place.clone(),
            motion,
            axis: pose.rotation * axis.unwrap_or(Vector3::x()),
            anchor: (pose * Point3::origin()).coords,
            reference: 0.0,
            armature: 0.0,
            damping: [number_in("dynamics", "damping")?.unwrap_or(0.0), 0.0],
            friction: number_in("dynamics", "friction")?.unwrap_or(0.0),
            stiffness: [0.0; 3],
            rest: 0.0,
            attributes: node.attributes.clone(),
        });
        let effort = number_in("limit", "effort")?.filter(|effort| *effort > 0.0);
        self.drives.push(Drive {
            tag: "joint".into(),
            gear: 1.0,
            gear_text: None,
            name: format!("{name}_drive"),
            place: node.place.clone(),
            joint: index,
            target: None,
            plain: true,
            gain: 1.0,
            load: 0.0,
            stiffness: 0.0,
            damping: 0.0,
            limit: effort.map(|effort| (-effort, effort)),
            clipped: false,
        });
        Ok(Some(index))
    }
}

/// Pose of an element's `origin`.
fn origin(node: &Node) -> Result<Isometry3<f64>> {
    let Some(origin) = node.first("origin") else {
        return Ok(Isometry3::identity());
    };
    let place = vector(origin, "xyz", origin.get("xyz"))?.unwrap_or_default();
    let turn = vector(origin, "rpy", origin.get("rpy"))?.unwrap_or_default();
    Ok(Isometry3::from_parts(
        Translation3::from(place),
        UnitQuaternion::from_euler_angles(turn.x, turn.y, turn.z),
    ))
}

fn inertia(node: &Node) -> Result<Mass> {
    let number_in = |tag: &str, key: &str| -> Result<f64> {
        let inner = node.first(tag);
        let inner = inner.ok_or_else(|| node.error(format!("`inertial` has no `{tag}`")))?;
        let found = number(inner, key, inner.get(key))?;
        found.ok_or_else(|| inner.error(format!("`{tag}` has no `{key}`")))
    };
    let [xx, xy, xz, yy, yz, zz] = [
        number_in("inertia", "ixx")?,
        number_in("inertia", "ixy")?,
        number_in("inertia", "ixz")?,
        number_in("inertia", "iyy")?,
        number_in("inertia", "iyz")?,
        number_in("inertia", "izz")?,
    ];
    Ok(Mass {
        mass: number_in("mass", "value")?,
        centre: Vector3::zeros(),
        moments: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
    })
}
