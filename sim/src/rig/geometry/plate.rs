//! `[[plate]]`: a plate that rises, rolls and pitches.

use std::ops::Range;

use super::Plate;
use crate::effects::Sign;
use crate::error::Error;
use crate::rig::names::{Component, Section};
use crate::rig::reader::TableReader;
use crate::rig::{Body, Rig};
use crate::unit::Motion;

pub(super) const SECTION: Section = (
    "plate",
    &["name", "mass", "inertia", "height", "tip"],
    Component::Plate,
);

const COORDINATES: [&str; 3] = ["z", "roll", "pitch"];

impl Plate {
    /// Indices of the bodies that it became.
    pub fn bodies(&self) -> Range<usize> {
        self.first_body..self.first_body + COORDINATES.len()
    }
}

/// Names of the bodies that a plate becomes.
pub(in crate::rig) fn generated(table: &TableReader) -> Result<[String; 3], Error> {
    let name = table.text("name")?.value;
    Ok(COORDINATES.map(|own| format!("{name}.{own}")))
}

/// Reads a plate and adds its bodies to the rig.
pub(in crate::rig) fn expand(table: &TableReader, rig: &mut Rig) -> Result<(), Error> {
    let mass = table.parameter("mass", Sign::Positive)?;
    let inertia = table.parameter("inertia", Sign::Positive)?;
    let first_body = rig.bodies.len();
    for (index, name) in generated(table)?.into_iter().enumerate() {
        let (motion, inertia) = match index {
            0 => (Motion::Slide, &mass),
            _ => (Motion::Hinge, &inertia),
        };
        rig.bodies.push(Body {
            name,
            motion,
            inertia: inertia.clone(),
            start: None,
            start_velocity: None,
            motion_from: None,
        });
    }
    rig.geometry.plates.push(Plate {
        name: table.text("name")?.value.to_owned(),
        height: table.parameter_or("height", Sign::Any, 0.0)?,
        tip: table.parameter_or("tip", Sign::Any, 0.0)?,
        first_body,
    });
    Ok(())
}
