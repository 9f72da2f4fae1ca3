//! `[[waveguide]]`: a fibre along a chain that loses light when stretched.

use super::Waveguide;
use crate::effects::Sign;
use crate::error::Error;
use crate::rig::names::{Component, Names, Section};
use crate::rig::reader::TableReader;

pub(super) const SECTION: Section = (
    "waveguide",
    &["name", "chain", "radius", "angle", "span", "loss"],
    Component::Waveguide,
);

pub(in crate::rig) fn read_waveguide(
    table: &TableReader,
    names: &Names,
) -> Result<Waveguide, Error> {
    let span = match table.numbers("span", Sign::NonNegative)?.as_deref() {
        None => [0.0, 1.0],
        Some(&[from, to]) if from < to && to <= 1.0 => [from, to],
        Some(_) => {
            let message = format!("`span` of {}: expected [from, to]", table.what);
            return Err(table
                .error_at("span", message)
                .helped("fractions of the chain's length, 0 <= from < to <= 1"));
        }
    };
    Ok(Waveguide {
        name: table.text("name")?.value.to_owned(),
        chain: names.chain(table, "chain")?,
        radius: table.parameter("radius", Sign::Positive)?,
        angle: table.parameter_or("angle", Sign::Any, 0.0)?,
        span,
        loss: table.parameter("loss", Sign::NonZero)?,
    })
}
