//! Readings to physical values and commands to duties, by the scales of [`crate::scales`].

use model::control::{LIMITS, MEASURED, NS, NU, NY, Session};
use sinew_device::converter::Counter;

use crate::scales::{ACTUATOR_SPANS, SENSOR_SCALES};

/// Outputs that are read: none where the channels say them.
pub const OUTPUTS_READ: usize = Session::OUTPUTS_READ;
/// Sensors: the outputs that are read, then the sensor channels.
pub const SENSORS: usize = OUTPUTS_READ + MEASURED;

/// Traces of the readings before: positions of the encoders.
pub struct Readings {
    counters: [Counter; SENSORS],
}

impl Readings {
    /// Readings of a board that has just started.
    pub const fn new() -> Self {
        Self {
            counters: [Counter::new(); SENSORS],
        }
    }

    /// Raw readings to outputs and channels, physical units; NaN where a converter stands at its
    /// end, for an output that is not read, and for what the network remembers.
    pub fn measured(&mut self, raw: &[u16; SENSORS], full_scale: u16) -> ([f32; NY], [f32; NS]) {
        let mut values = raw
            .iter()
            .zip(&SENSOR_SCALES)
            .zip(&mut self.counters)
            .map(|((raw, scale), counter)| scale.physical(*raw, full_scale, counter));
        let y = core::array::from_fn(|output| {
            let is_read = output < OUTPUTS_READ;
            is_read.then(|| values.next()).flatten().unwrap_or(f32::NAN)
        });
        let s = core::array::from_fn(|_| values.next().unwrap_or(f32::NAN));
        (y, s)
    }
}

impl Default for Readings {
    fn default() -> Self {
        Self::new()
    }
}

/// A command to duties, 0 to `full_scale`. Outside its span: the nearest end.
pub fn duties(u: &[f32; NU], full_scale: u16) -> [u16; NU] {
    let mut duties = [0; NU];
    for (((duty, u), span), safe) in duties
        .iter_mut()
        .zip(u)
        .zip(&ACTUATOR_SPANS)
        .zip(&LIMITS.safe)
    {
        // A span without a length drives nothing.
        *duty = span
            .code(*u, full_scale)
            .or(span.code(*safe, full_scale))
            .unwrap_or(0);
    }
    duties
}
