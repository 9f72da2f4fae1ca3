//! Columns of a recording as a rig file names them.

use super::reader::TableReader;
use crate::error::Error;
use crate::unit;

/// The factor of a column's unit to SI, from the `unit` key; 1 without one.
pub(super) fn read_factor(table: &TableReader) -> Result<f64, Error> {
    let Some(unit) = table.optional_text("unit")? else {
        return Ok(1.0);
    };
    unit::factor(unit.value).map_err(|unknown| {
        table
            .error_at(
                "unit",
                format!("`unit` of {}: unknown unit `{}`", table.what, unit.value),
            )
            .helped(unknown.help)
    })
}
