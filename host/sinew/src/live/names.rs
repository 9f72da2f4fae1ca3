//! Names of the signals of a board: the model that its firmware carries says so.

use std::path::Path;

use sinew_device::protocol::{Identity, PROTOCOL, ToDevice, ToHost};
use sinew_model::fingerprint;
use sinew_model::spec::{ModelSpec, Signal};
use sinew_model::store;

use super::Units;
use crate::adopt::Columns;
use crate::device::Device;
use sinew_ident::error::{Error, Result};
use sinew_sim::Rig;

/// Columns of inputs, outputs and channels, in the model's order.
#[derive(Clone, Debug)]
pub struct Names {
    /// Commands.
    pub inputs: Vec<String>,
    /// Measured outputs.
    pub outputs: Vec<String>,
    /// Sensor channels.
    pub channels: Vec<String>,
    /// Columns of the parameters that the controller estimates.
    pub learned: Columns,
    /// Units of the columns in files; a board speaks SI.
    pub units: Units,
    /// Limits of each command, SI.
    pub input_range: Vec<[f64; 2]>,
    /// Range of training of each output, SI.
    pub output_range: Vec<[f64; 2]>,
    fingerprint: u32,
}

impl Names {
    /// Reads the model in `folder`.
    ///
    /// # Errors
    /// It is no model.
    pub fn load(folder: &Path) -> Result<Self> {
        Ok(Self::of(&store::load(folder).map_err(Error::refused)?))
    }

    /// Of a model.
    pub fn of(spec: &ModelSpec) -> Self {
        let names = |signals: &[Signal]| signals.iter().map(|s| s.name.clone()).collect();
        Self {
            inputs: names(&spec.inputs),
            outputs: names(&spec.outputs),
            channels: names(&spec.channels),
            learned: Columns::of(spec),
            units: Units::default(),
            input_range: (spec.control.lower.iter().zip(&spec.control.upper))
                .map(|(lower, upper)| [*lower, *upper])
                .collect(),
            output_range: (spec.outputs.iter())
                .map(|it| [it.offset - it.span, it.offset + it.span])
                .collect(),
            fingerprint: fingerprint(spec),
        }
    }

    /// The same, with files in the units of a rig's columns; without a rig in SI.
    ///
    /// # Errors
    /// A rig of another model; without one, a column whose name ends in another unit.
    pub fn in_units_of(mut self, rig: Option<&Path>) -> Result<Self> {
        let groups = [&self.inputs, &self.outputs, &self.channels];
        let columns = groups.into_iter().flatten();
        self.units = match rig {
            Some(path) => Units::of(&Rig::load(path)?, columns)?,
            None => Units::si(columns)?,
        };
        Ok(self)
    }

    /// Asks a board who it is, and refuses one that carries another model.
    ///
    /// # Errors
    /// No answer, or the wrong board.
    pub fn greet(&self, device: &mut Device) -> Result<Identity> {
        let answer = device.insist(&ToDevice::Hello, |a| matches!(a, ToHost::Hello(_)))?;
        let ToHost::Hello(identity) = answer else {
            return Err(Error::failed("the device does not say who it is"));
        };
        if identity.protocol != PROTOCOL || identity.model != self.fingerprint {
            return Err(Error::failed(format!(
                "the board carries model {:08x} and speaks protocol {}; this is model {:08x} and protocol {PROTOCOL}",
                identity.model, identity.protocol, self.fingerprint
            ))
            .help("sinew flash --board BOARD --model DIR"));
        }
        Ok(identity)
    }
}

#[cfg(test)]
impl Names {
    pub(crate) fn for_test(inputs: Vec<String>, outputs: Vec<String>) -> Self {
        Self {
            input_range: vec![[-1.0, 1.0]; inputs.len()],
            output_range: vec![[-1.0, 1.0]; outputs.len()],
            inputs,
            outputs,
            channels: Vec::new(),
            learned: Columns::default(),
            units: Units::default(),
            fingerprint: 0,
        }
    }
}
