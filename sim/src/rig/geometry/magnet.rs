//! `[[magnet]]` on a plate and `[[magnetometer]]` beside it.

use super::{Magnet, Magnetometer};
use crate::effects::Sign;
use crate::error::Error;
use crate::rig::names::{Component, Names, Section};
use crate::rig::reader::TableReader;

pub(super) const MAGNET: Section = ("magnet", &["name", "plate", "at", "axis", "moment"], |_| {
    Component::Magnet
});

pub(super) const MAGNETOMETER: Section = ("magnetometer", &["name", "at"], Component::Magnetometer);

/// Three numbers, if the key is there.
fn triple(table: &TableReader, key: &str) -> Result<Option<[f64; 3]>, Error> {
    let Some(numbers) = table.numbers(key, Sign::Any)? else {
        return Ok(None);
    };
    <[f64; 3]>::try_from(numbers).map(Some).map_err(|numbers| {
        table.error_at(
            key,
            format!(
                "`{key}` of {}: expected [x, y, z], found {} numbers",
                table.what,
                numbers.len()
            ),
        )
    })
}

fn required_triple(table: &TableReader, key: &str) -> Result<[f64; 3], Error> {
    triple(table, key)?.ok_or_else(|| table.missing(key, "[x, y, z] in metres"))
}

pub(in crate::rig) fn read_magnet(table: &TableReader, names: &Names) -> Result<Magnet, Error> {
    let axis = triple(table, "axis")?.unwrap_or([0.0, 0.0, 1.0]);
    let length = crate::math::sqrt(axis.iter().map(|a| a * a).sum());
    if length == 0.0 {
        let message = format!("`axis` of {} points nowhere", table.what);
        return Err(table.error_at("axis", message));
    }
    Ok(Magnet {
        name: table.text("name")?.value.to_owned(),
        plate: names.plate(table, "plate")?,
        at: required_triple(table, "at")?,
        axis: axis.map(|a| a / length),
        moment: table.parameter("moment", Sign::Any)?,
    })
}

pub(in crate::rig) fn read_magnetometer(table: &TableReader) -> Result<Magnetometer, Error> {
    Ok(Magnetometer {
        name: table.text("name")?.value.to_owned(),
        at: required_triple(table, "at")?,
    })
}
