//! Mechanisms of other programs as rigs: MJCF and URDF (docs/reference/mjcf.md).
//!
//! Links and joints are laid out in the reference configuration. A joint becomes a body of the rig
//! with the inertia of all that it moves. Joints that move each other are refused: a rig has no
//! such terms. What a rig cannot say is listed, by name and line.

mod changes;
mod defaults;
mod document;
mod geom;
mod left_out;
mod mjcf;
mod numbers;
mod text;
mod tree;
mod urdf;

use std::path::Path;

use sinew_sim::Rig;
use sinew_sim::suggest::nearest;

pub use self::changes::{Change, Changes, changes};
use self::document::{Node, Place};
use self::tree::Tree;
use crate::error::{Error, Result};

/// Format of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MuJoCo's.
    Mjcf,
    /// ROS's.
    Urdf,
}

/// A mechanism as a rig.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The rig file, which has been read back.
    pub text: String,
    /// Parts of the file that the rig does not say, a line each with its place.
    pub left_out: Vec<String>,
    /// Things that the file does not say and the rig needs, a sentence each.
    pub added: Vec<String>,
}

/// Content of a file.
#[derive(Clone, Debug)]
struct Mechanism {
    name: String,
    tree: Tree,
    drives: Vec<Drive>,
    readings: Vec<Reading>,
    cables: Vec<Cable>,
    left_out: Vec<String>,
    /// Its angles are degrees.
    degrees: bool,
}

/// An actuator at a joint: force = gain u + load - stiffness q - damping v.
#[derive(Clone, Debug)]
struct Drive {
    tag: String,
    name: String,
    place: Place,
    joint: usize,
    gear: f64,
    /// As the file says it.
    gear_text: Option<String>,
    /// Quantity that its input is a target of; `None` for a force or a plain number.
    target: Option<&'static str>,
    /// Its input is the force itself.
    plain: bool,
    gain: f64,
    load: f64,
    stiffness: f64,
    damping: f64,
    limit: Option<(f64, f64)>,
    /// The input is clipped at its limit.
    clipped: bool,
}

/// A sensor at a joint.
#[derive(Clone, Debug)]
struct Reading {
    name: String,
    joint: usize,
    velocity: bool,
}

/// A fixed tendon: tension = stiffness (sum of coefficients times coordinates - length) + damping.
#[derive(Clone, Debug)]
struct Cable {
    name: String,
    place: Place,
    arms: Vec<(usize, f64)>,
    stiffness: f64,
    damping: f64,
    length: f64,
}

/// Reads a mechanism and makes a rig of it. `joints`: names of the joints that move, where not all
/// do; the others are held at their reference.
///
/// # Errors
/// `Read`; `File` for a file that is broken, for joints that no rig has or that move each other;
/// `Arguments` for a joint that is not there.
pub fn import(path: &Path, format: Format, joints: &[String]) -> Result<Imported> {
    of_root(&document::load(path)?, path, format, joints)
}

/// A mechanism as [`import`], in memory already; `path` is what errors call it and where the files
/// that it includes would be, which are refused.
///
/// # Errors
/// As [`import`].
pub fn import_text(text: &str, path: &Path, format: Format, joints: &[String]) -> Result<Imported> {
    of_root(&document::parse(text, path)?, path, format, joints)
}

fn of_root(root: &Node, path: &Path, format: Format, joints: &[String]) -> Result<Imported> {
    let mut mechanism = of_format(root, format)?;
    let moving = moving(&mechanism, path, joints)?;
    let held = (0..mechanism.tree.joints.len()).filter(|joint| !moving.contains(joint));
    for joint in held.map(|joint| &mechanism.tree.joints[joint]) {
        let line = format!("{}: joint \"{}\": held still", joint.place, joint.name);
        mechanism.left_out.push(line);
    }
    let coordinates = mechanism.tree.coordinates(&moving)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let (text, mut added) = text::write(&mut mechanism, &coordinates, &file);
    if format == Format::Urdf {
        added.push("gravity of 9.81 m/s^2 along -z, and an input at each joint".into());
    }
    Rig::parse(&text, "the rig of the mechanism")?;
    mechanism.left_out.sort_by_key(|line| line_of(line));
    Ok(Imported {
        text,
        left_out: mechanism.left_out,
        added,
    })
}

fn read(path: &Path, format: Format) -> Result<Mechanism> {
    of_format(&document::load(path)?, format)
}

fn of_format(root: &Node, format: Format) -> Result<Mechanism> {
    match format {
        Format::Mjcf => mjcf::read(root),
        Format::Urdf => urdf::read(root),
    }
}

fn moving(mechanism: &Mechanism, path: &Path, joints: &[String]) -> Result<Vec<usize>> {
    let all = &mechanism.tree.joints;
    if all.is_empty() {
        return Err(Error::file(path, "no joint: nothing in it can move"));
    }
    if joints.is_empty() {
        return Ok((0..all.len()).collect());
    }
    let find = |name: &String| {
        let names = || all.iter().map(|joint| joint.name.as_str());
        names().position(|other| other == name).ok_or_else(|| {
            let error = Error::arguments(format!("--joint {name}: there is no such joint"));
            let error = error.expected(names().collect::<Vec<_>>().join(", "));
            match nearest(name, names()) {
                Some(meant) => error.help(format!("did you mean `{meant}`?")),
                None => error,
            }
        })
    };
    let mut moving = joints.iter().map(find).collect::<Result<Vec<usize>>>()?;
    moving.sort_unstable();
    moving.dedup();
    Ok(moving)
}

/// File and line at the start of a line about it, for sorting.
fn line_of(line: &str) -> (String, usize) {
    let mut parts = line.splitn(3, ':');
    let file = parts.next().unwrap_or_default().to_owned();
    let number = parts.next().and_then(|number| number.parse().ok());
    (file, number.unwrap_or(0))
}

#[cfg(test)]
mod tests;
