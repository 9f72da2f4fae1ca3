//! Quantities that goals are about: signals of sensors and states of the plant.

use sinew_ident::error::{Error, Result};
use sinew_sim::suggest::nearest;
use sinew_sim::unit::of_column;
use sinew_sim::{Plant, Stepper};

/// A number that a simulation gives at every row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// Signal of a sensor, by its index.
    Sensor(usize),
    /// State, by its index in [`Plant::state_names`].
    State(usize),
}

impl Quantity {
    /// Finds a sensor by its name or column, else a state.
    ///
    /// # Errors
    /// `Arguments` for a name that is neither, with the nearest one.
    pub fn find(plant: &Plant, name: &str) -> Result<Self> {
        let sensors = plant.sensors();
        let sensor = sensors.iter().position(|sensor| sensor.name == name);
        let sensor = sensor.or_else(|| sensors.iter().position(|sensor| sensor.column == name));
        let states = plant.state_names();
        let state = states.iter().position(|state| state == name);
        if let Some(found) = sensor.map(Self::Sensor).or(state.map(Self::State)) {
            return Ok(found);
        }
        let names = || {
            let sensors = sensors.iter();
            let sensors = sensors.flat_map(|sensor| [sensor.name.as_str(), sensor.column.as_str()]);
            sensors.chain(states.iter().map(String::as_str))
        };
        let error = Error::arguments(format!("`{name}` names no sensor and no coordinate"));
        let listed: Vec<&str> = names().take(12).collect();
        let error = error.expected(format!("a name such as `{}`", listed.join("`, `")));
        Err(match nearest(name, names()) {
            Some(meant) => error.help(format!("did you mean `{meant}`?")),
            None => error,
        })
    }

    /// Factor from the unit in which the quantity is typed and reported to SI.
    pub fn factor(self, plant: &Plant) -> f64 {
        match self {
            Self::Sensor(sensor) => plant.sensors()[sensor].column_factor,
            Self::State(_) => 1.0,
        }
    }

    /// Unit in which the quantity is typed and reported; empty where none is known.
    pub fn unit(self, plant: &Plant) -> String {
        match self {
            Self::Sensor(sensor) => of_column(&plant.sensors()[sensor].column).to_owned(),
            Self::State(_) => String::new(),
        }
    }

    /// Value now, SI. `state` is [`Stepper::state`].
    pub fn read<S: Copy>(self, signal: impl Fn(usize) -> S, state: &[S]) -> S {
        match self {
            Self::Sensor(sensor) => signal(sensor),
            Self::State(index) => state[index],
        }
    }

    /// Value of a plain simulation now, SI.
    pub fn plain(self, stepper: &Stepper<f64>) -> f64 {
        match self {
            Self::Sensor(sensor) => stepper.signal(sensor),
            Self::State(index) => stepper.state()[index],
        }
    }
}
