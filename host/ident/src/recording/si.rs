//! Columns of a recording in SI units, as a plant names them: the one place that converts.

use sinew_sim::{Input, SensorChannel};

use super::{Held, Recording};
use crate::error::Result;

impl Recording {
    /// Samples of a column times `factor`, its unit in SI; NaN where a sample is missing.
    /// `wanted_by` says in an error who needs the column.
    ///
    /// # Errors
    /// `File` for a column that is not there.
    pub fn si(&self, column: &str, factor: f64, wanted_by: &str) -> Result<Vec<f64>> {
        let values = self.require(column, wanted_by)?;
        Ok(values.iter().map(|value| value * factor).collect())
    }

    /// Samples of a sensor, SI; NaN where a sample is missing.
    ///
    /// # Errors
    /// `File` for a column that is not there.
    pub fn sensor(&self, sensor: &SensorChannel) -> Result<Vec<f64>> {
        let wanted_by = format!("sensor `{}` of the rig", sensor.name);
        self.si(&sensor.column, sensor.column_factor, &wanted_by)
    }

    /// Values of an input, SI; the last one is held where a sample is missing.
    ///
    /// # Errors
    /// `File` for a column that is not there or has no value.
    pub fn input(&self, input: &Input) -> Result<Held> {
        let mut held = self.held(&input.column, &input.wanted_by())?;
        held.values
            .iter_mut()
            .for_each(|value| *value *= input.column_factor);
        Ok(held)
    }
}
