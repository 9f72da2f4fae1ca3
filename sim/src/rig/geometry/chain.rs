//! `[[chain]]`: a soft segment, cut into pieces of constant curvature.

use std::ops::Range;

use super::Chain;
use crate::effects::Sign;
use crate::error::Error;
use crate::law::LawKind;
use crate::rig::laws::read_applied;
use crate::rig::names::{Component, Section};
use crate::rig::reader::TableReader;
use crate::rig::{Body, Damper, End, Rig, Spring, Value};
use crate::unit::Motion;

pub(super) const SECTION: Section = (
    "chain",
    &[
        "name",
        "segments",
        "length",
        "inertia",
        "stiffness",
        "damping",
        "rest_x",
        "rest_y",
        "segment",
        "law",
        "law_length",
        "law_width",
    ],
    Component::Chain,
);

/// More would be a finite element method, and a slow one.
const MOST_SEGMENTS: usize = 32;

const AXES: [&str; 2] = ["x", "y"];

impl Chain {
    /// Indices of the bodies that it became.
    pub fn bodies(&self) -> Range<usize> {
        self.first_body..self.first_body + AXES.len() * self.segments
    }
}

fn segments(table: &TableReader) -> Result<usize, Error> {
    table
        .count("segments", 1, MOST_SEGMENTS)?
        .ok_or_else(|| table.missing("segments", "how many pieces bend on their own"))
}

/// Names of the bodies, then of the springs, that a chain becomes.
pub(in crate::rig) fn generated(table: &TableReader) -> Result<[Vec<String>; 2], Error> {
    let name = table.text("name")?.value;
    let of = |before: &str| -> Result<Vec<String>, Error> {
        let segments = 1..=segments(table)?;
        let each = |k| AXES.map(|axis| format!("{name}.{before}{axis}{k}"));
        Ok(segments.flat_map(each).collect())
    };
    Ok([of("")?, of("flex_")?])
}

/// A parameter of each segment: its own from the `segment` list, or the chain's.
fn of_segments(
    table: &TableReader,
    own: &[TableReader],
    count: usize,
    key: &str,
    sign: Sign,
) -> Result<Vec<Value>, Error> {
    (0..count)
        .map(|k| {
            let own = (own.get(k))
                .map(|own| own.optional_parameter(key, sign))
                .transpose()?;
            match own.flatten() {
                Some(value) => Ok(value),
                None => table.parameter(key, sign),
            }
        })
        .collect()
}

/// Reads a chain and adds its bodies, springs and dampers to the rig. Numbers that the segments
/// share share their place in the file, and so their parameter.
pub(in crate::rig) fn expand(table: &TableReader, rig: &mut Rig) -> Result<(), Error> {
    let count = segments(table)?;
    let own = table.tables("segment")?;
    for part in &own {
        part.allow(&["inertia", "stiffness", "damping"])?;
    }
    if !own.is_empty() && own.len() != count {
        return Err(table.error_at(
            "segment",
            format!(
                "{} has {count} segments and its `segment` list {}",
                table.what,
                own.len()
            ),
        ));
    }
    let each = |key, sign| of_segments(table, &own, count, key, sign);
    let inertia = each("inertia", Sign::Positive)?;
    let law = read_applied(table, LawKind::Spring, Motion::Hinge, rig)?;
    let stiffness = match law {
        Some(_) => {
            if let Some(part) = own.iter().find(|part| part.has("stiffness")) {
                let message = format!("{} has `law`, and a segment its `stiffness`", table.what);
                return Err(part
                    .error_at("stiffness", message)
                    .helped("the law is the whole torque of every segment: leave it out"));
            }
            vec![table.held("stiffness", 0.0); count]
        }
        None => each("stiffness", Sign::NonNegative)?,
    };
    let damping = each("damping", Sign::NonNegative)?;
    let rest = [
        table.parameter_or("rest_x", Sign::Any, 0.0)?,
        table.parameter_or("rest_y", Sign::Any, 0.0)?,
    ];
    let [bodies, springs] = generated(table)?;
    let first_body = rig.bodies.len();
    for (k, (body, spring)) in bodies.into_iter().zip(springs).enumerate() {
        let (segment, axis) = (k / AXES.len(), k % AXES.len());
        rig.bodies.push(Body {
            name: body,
            motion: Motion::Hinge,
            inertia: inertia[segment].clone(),
            start: None,
            start_velocity: None,
            motion_from: None,
        });
        let (from, to) = (End::Ground, End::Body(first_body + k));
        rig.dampers.push(Damper {
            name: format!("{spring}.damper"),
            from,
            to,
            damping: damping[segment].clone(),
            law: None,
        });
        rig.springs.push(Spring {
            name: spring,
            from,
            to,
            stiffness: stiffness[segment].clone(),
            rest: rest[axis].clone(),
            law: law.clone(),
        });
    }
    rig.geometry.chains.push(Chain {
        name: table.text("name")?.value.to_owned(),
        segments: count,
        length: table.parameter("length", Sign::Positive)?,
        first_body,
    });
    Ok(())
}
