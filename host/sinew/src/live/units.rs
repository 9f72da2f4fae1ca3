//! Units of columns beside the SI of a board: a rig may have its columns in degrees or millimetres.

use std::collections::HashMap;

use sinew_ident::error::{Error, Result};
use sinew_sim::{Plant, Rig, unit};

/// Factor to SI of each column that is not in it.
#[derive(Clone, Debug, Default)]
pub struct Units {
    factors: HashMap<String, f64>,
}

impl Units {
    /// The units that a rig gives its columns.
    ///
    /// # Errors
    /// A rig that cannot be compiled; one without one of these columns.
    pub fn of<'a>(rig: &Rig, columns: impl IntoIterator<Item = &'a String>) -> Result<Self> {
        let plant = Plant::new(rig)?;
        let inputs = plant.inputs().iter();
        let inputs = inputs.map(|it| (it.column.clone(), it.column_factor));
        let sensors = plant.sensors().iter();
        let sensors = sensors.map(|it| (it.column.clone(), it.column_factor));
        let factors: HashMap<String, f64> = inputs.chain(sensors).collect();
        if let Some(column) = columns.into_iter().find(|it| !factors.contains_key(*it)) {
            let message = format!("no actuator and no sensor has the column `{column}`");
            return Err(Error::file(&rig.file, message).expected("the rig of the board's model"));
        }
        Ok(Self { factors })
    }

    /// All columns in SI, where their names do not say otherwise.
    ///
    /// # Errors
    /// `Arguments` for a column whose name ends in another unit: a board speaks SI.
    pub fn si<'a>(columns: impl IntoIterator<Item = &'a String>) -> Result<Self> {
        let other = columns.into_iter().find(|column| {
            let named = unit::of_column(column);
            unit::factor(named).is_ok_and(|factor| factor != 1.0)
        });
        match other {
            Some(column) => Err(Error::arguments(format!(
                "the board speaks SI, and the column `{column}` is in {}",
                unit::of_column(column)
            ))
            .help("--rig RIG has the unit of each column")),
            None => Ok(Self::default()),
        }
    }

    /// One of a column's unit in SI.
    pub fn factor(&self, column: &str) -> f64 {
        self.factors.get(column).copied().unwrap_or(1.0)
    }

    /// Factors of columns in their order.
    pub fn factors(&self, columns: &[String]) -> Vec<f64> {
        columns.iter().map(|column| self.factor(column)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str = "format = \"sinew-rig/1\"\nname = \"arm\"\n[[body]]\nname = \"arm\"\n\
        motion = \"hinge\"\ninertia = 0.1\n[[actuator]]\nname = \"motor\"\ndrives = \"arm\"\n\
        input = \"tau_Nm\"\ngain = 1.0\n[[sensor]]\nname = \"encoder\"\nreads = \"arm.position\"\n\
        signal = \"q_deg\"\nunit = \"deg\"\n";

    #[test]
    fn a_column_in_degrees_needs_the_rig_that_says_so() {
        let columns = ["tau_Nm".to_owned(), "q_deg".to_owned()];
        let error = Units::si(&columns).unwrap_err().to_string();
        assert!(error.contains("`q_deg` is in deg"), "{error}");
        let rig = Rig::parse(RIG, "arm.toml").unwrap();
        let units = Units::of(&rig, &columns).unwrap();
        assert_eq!(units.factors(&columns), [1.0, std::f64::consts::PI / 180.0]);
        assert_eq!(Units::si(&columns[..1]).unwrap().factor("tau_Nm"), 1.0);
        let other = Units::of(&rig, &["q_m".to_owned()])
            .unwrap_err()
            .to_string();
        assert!(other.contains("`q_m`"), "{other}");
    }
}
