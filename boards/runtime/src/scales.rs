//! Physical values behind codes and duties.
//!
//! As it stands, a sensor's range is the range that the model was trained on (code 0: model -1,
//! full scale: model +1), and an actuator's is its limits (duty 0: lower, duty 1: upper). `sinew
//! emit --wiring` prints this file from a rig's own wiring.

use model::control::{LIMITS, NU, SCALING};
use sinew_device::converter::{Scale, Span};

use crate::wiring::{OUTPUTS_READ, SENSORS};

/// Scale of each sensor: the outputs that are read, then the channels.
pub const SENSOR_SCALES: [Scale; SENSORS] = sensor_scales();
/// Physical values of each actuator's duty.
pub const ACTUATOR_SPANS: [Span; NU] = actuator_spans();

const fn sensor_scales() -> [Scale; SENSORS] {
    let mut scales = [Scale::Converter(Span {
        zero: 0.0,
        full: 0.0,
    }); SENSORS];
    let mut i = 0;
    while i < SENSORS {
        scales[i] = Scale::Converter(if i < OUTPUTS_READ {
            Span::of_model(SCALING.y.span[i], SCALING.y.offset[i])
        } else {
            Span::of_model(
                SCALING.s.span[i - OUTPUTS_READ],
                SCALING.s.offset[i - OUTPUTS_READ],
            )
        });
        i += 1;
    }
    scales
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
