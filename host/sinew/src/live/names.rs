//! Names of the signals of a board: the model that its firmware carries says so.

use std::path::Path;

use sinew_device::protocol::{Identity, PROTOCOL, ToDevice, ToHost};
use sinew_model::fingerprint;
use sinew_model::spec::{ModelSpec, Signal};
use sinew_model::store;

use crate::adopt::Columns;
use crate::device::Device;
use sinew_ident::error::{Error, Result};

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
            fingerprint: fingerprint(spec),
        }
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
            inputs,
            outputs,
            channels: Vec::new(),
            learned: Columns::default(),
            fingerprint: 0,
        }
    }
}
