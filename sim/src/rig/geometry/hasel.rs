//! `[[hasel]]`: a row of zipping pouches that pulls along its path.

use super::{Hasel, Route, read_route, same_place};
use crate::effects::Sign;
use crate::error::Error;
use crate::rig::names::{Component, Names, Section};
use crate::rig::reader::TableReader;
use crate::rig::{Rig, Value};

pub(super) const SECTION: Section = (
    "hasel",
    &[
        "name",
        "path",
        "slack",
        "pouches",
        "pouch_length",
        "width",
        "film_thickness",
        "permittivity",
        "fill_angle",
        "capacitance",
        "resistance",
        "film_stiffness",
    ],
    Component::Hasel,
);

/// More in a row than anybody has built.
const MOST_POUCHES: usize = 100;

/// A path: bodies with arms, and chains and plates.
type Path = (Vec<(usize, Value)>, Vec<Route>);

/// The `path` of a tendon or a HASEL actuator.
pub(in crate::rig) fn read_path(
    table: &TableReader,
    names: &Names,
    rig: &Rig,
) -> Result<Path, Error> {
    let mut path: Vec<(usize, Value)> = Vec::new();
    let mut routes = Vec::new();
    for part in table.tables("path")? {
        let part = part.called(format!("the path of {}", table.what));
        if let Some(route) = read_route(&part, names, rig)? {
            if routes.iter().any(|other| same_place(other, &route)) {
                let message = format!("{} has a chain or a plate twice", part.what);
                return Err(part.error_at("", message));
            }
            routes.push(route);
            continue;
        }
        part.allow(&["body", "arm"])?;
        let body = names.body(&part, "body")?;
        if path.iter().any(|&(other, _)| other == body) {
            return Err(part.error_at("body", format!("{} has a body twice", part.what)));
        }
        path.push((body, part.parameter("arm", Sign::NonZero)?));
    }
    if path.is_empty() && routes.is_empty() {
        return Err(table
            .error_at("path", format!("{} has no path", table.what))
            .helped("path = [{ body = \"...\", arm = 0.01 }, ...]"));
    }
    Ok((path, routes))
}

pub(in crate::rig) fn read_hasel(
    table: &TableReader,
    names: &Names,
    rig: &Rig,
) -> Result<Hasel, Error> {
    let (path, routes) = read_path(table, names, rig)?;
    let fill_angle = table.parameter("fill_angle", Sign::Positive)?;
    // At a right angle the pouch is full at rest and never pulls; the bounds of a fit have to keep
    // off too.
    let widest = fill_angle.max.unwrap_or(fill_angle.value);
    let narrowest = fill_angle.min.unwrap_or(fill_angle.value);
    if narrowest < 0.05 || widest > 1.5 {
        let message = format!("`fill_angle` of {}: expected from 0.05 to 1.5", table.what);
        return Err(table
            .error_at("fill_angle", message)
            .helped("rad; half the angle of the arcs at rest: small is flat, 1.57 a full circle"));
    }
    Ok(Hasel {
        name: table.text("name")?.value.to_owned(),
        path,
        routes,
        slack: table.parameter_or("slack", Sign::Any, 0.0)?,
        pouches: (table.count("pouches", 1, MOST_POUCHES)?)
            .ok_or_else(|| table.missing("pouches", "how many in a row"))?,
        pouch_length: table.parameter("pouch_length", Sign::Positive)?,
        width: table.parameter("width", Sign::Positive)?,
        film_thickness: table.parameter("film_thickness", Sign::Positive)?,
        permittivity: table.parameter("permittivity", Sign::Positive)?,
        fill_angle,
        capacitance: table.parameter("capacitance", Sign::Positive)?,
        resistance: table.parameter("resistance", Sign::Positive)?,
        film_stiffness: table.parameter("film_stiffness", Sign::NonNegative)?,
    })
}
