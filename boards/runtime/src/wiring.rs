//! Physical value of each converter code: the page to edit for a rig of your own.
//!
//! As it stands, a sensor's range is the range that the model was trained on (code 0: model -1,
//! full scale: model +1), and an actuator's is its limits (duty 0: lower, duty 1: upper). Write
//! your own [`Span`]s where your sensors and amplifiers differ; the order is the model's.

use model::control::{LIMITS, MEASURED, NS, NU, NY, SCALING};
use sinew_device::converter::Span;

/// Converter channels: the outputs, then the sensor channels.
pub const SENSORS: usize = NY + MEASURED;

/// Physical values of each sensor's converter.
pub const SENSOR_SPANS: [Span; SENSORS] = sensor_spans();
/// Physical values of each actuator's duty.
pub const ACTUATOR_SPANS: [Span; NU] = actuator_spans();

const fn sensor_spans() -> [Span; SENSORS] {
    let mut spans = [Span {
        zero: 0.0,
        full: 0.0,
    }; SENSORS];
    let mut i = 0;
    while i < SENSORS {
        spans[i] = if i < NY {
            Span::of_model(SCALING.y.span[i], SCALING.y.offset[i])
        } else {
            Span::of_model(SCALING.s.span[i - NY], SCALING.s.offset[i - NY])
        };
        i += 1;
    }
    spans
}

const fn actuator_spans() -> [Span; NU] {
    let mut spans = [Span {
        zero: 0.0,
        full: 0.0,
    }; NU];
    let mut i = 0;
    while i < NU {
        spans[i] = Span {
            zero: LIMITS.lower[i],
            full: LIMITS.upper[i],
        };
        i += 1;
    }
    spans
}

/// Codes to outputs and channels, physical units; NaN where a converter stands at its end, and for
/// what the network remembers.
pub fn measured(codes: &[u16; SENSORS], full_scale: u16) -> ([f32; NY], [f32; NS]) {
    let mut values = codes
        .iter()
        .zip(&SENSOR_SPANS)
        .map(|(code, span)| span.physical(*code, full_scale));
    let y = core::array::from_fn(|_| values.next().unwrap_or(f32::NAN));
    let s = core::array::from_fn(|_| values.next().unwrap_or(f32::NAN));
    (y, s)
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
