//! Plant models.

use std::path::Path;

use pyo3::prelude::*;
use sinew_ident::mechanism::{Format, import};
use sinew_sim::{Plant, Rig};

use crate::data::refused;

/// A plant model, compiled once to see that it is sound.
#[pyclass(frozen, name = "NativeRig", module = "sinew_ident._native")]
pub struct NativeRig {
    /// The rig as it was read.
    pub rig: Rig,
    /// File or name that errors begin with.
    pub file: String,
}

/// A parameter for Python: name, value, unit, free.
type RawParameter = (String, f64, String, bool);

/// An input for Python: column, actuator, limits in SI.
type RawInput = (String, String, Option<(f64, f64)>);

/// A mechanism for Python: rig, left out, added.
type RawMechanism = (NativeRig, Vec<String>, Vec<String>);

impl NativeRig {
    /// A rig that came out of a computation.
    pub fn new(rig: Rig, file: impl Into<String>) -> Self {
        Self {
            rig,
            file: file.into(),
        }
    }

    /// The rig compiled.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn plant(&self) -> PyResult<Plant> {
        Plant::new(&self.rig).map_err(refused)
    }
}

#[pymethods]
impl NativeRig {
    /// Reads a file.
    #[staticmethod]
    fn load(path: &str) -> PyResult<Self> {
        let loaded = Self::new(Rig::load(path).map_err(refused)?, path);
        loaded.plant()?;
        Ok(loaded)
    }

    /// Reads text.
    #[staticmethod]
    fn parse(text: &str, file: &str) -> PyResult<Self> {
        let loaded = Self::new(Rig::parse(text, file).map_err(refused)?, file);
        loaded.plant()?;
        Ok(loaded)
    }

    /// Reads a mechanism (`mjcf` or `urdf`), the joints that are named or all of them. Gives the
    /// rig, what it does not say of the file, and what was added.
    #[staticmethod]
    fn of_mechanism(path: &str, format: &str, joints: Vec<String>) -> PyResult<RawMechanism> {
        let format = match format {
            "urdf" => Format::Urdf,
            _ => Format::Mjcf,
        };
        let read = import(Path::new(path), format, &joints).map_err(refused)?;
        let rig = Self::parse(&read.text, path)?;
        Ok((rig, read.left_out, read.added))
    }

    /// Its `name` key.
    #[getter]
    fn name(&self) -> String {
        self.rig.name.clone()
    }

    /// File that it came from.
    #[getter]
    fn file(&self) -> String {
        self.file.clone()
    }

    /// Text of the file with the values that it has now.
    fn to_toml(&self) -> String {
        self.rig.to_toml().to_owned()
    }

    /// The rig as MJCF, and what MuJoCo cannot represent.
    fn to_mjcf(&self) -> (String, Vec<String>) {
        let written = sinew_ident::mjcf::mjcf(&self.rig);
        (written.text, written.left_out)
    }

    /// Parameters: name, value, unit, free.
    fn parameters(&self) -> PyResult<Vec<RawParameter>> {
        let plant = self.plant()?;
        let parameters = plant.parameters().iter();
        let raw = parameters.map(|p| (p.name.clone(), p.value, p.unit.clone(), p.free));
        Ok(raw.collect())
    }

    /// Input columns.
    fn inputs(&self) -> PyResult<Vec<RawInput>> {
        let plant = self.plant()?;
        let inputs = plant.inputs().iter();
        Ok(inputs
            .map(|i| (i.column.clone(), i.actuator.clone(), i.limit))
            .collect())
    }

    /// Sensor columns with the name and the unit of the sensor.
    fn sensors(&self) -> PyResult<Vec<(String, String, String)>> {
        let plant = self.plant()?;
        let sensors = plant.sensors().iter();
        Ok(sensors
            .map(|s| (s.column.clone(), s.name.clone(), s.unit.clone()))
            .collect())
    }

    /// Effects that the file holds: kind and component.
    fn effects(&self) -> Vec<(String, String)> {
        let effects = self.rig.effects.iter();
        let named = effects.map(|effect| {
            let kind = effect.kind.description().kind.to_owned();
            (kind, self.rig.site_name(effect.site))
        });
        named.collect()
    }
}
