//! Sources in which a wired board differs: scales for the runtime, pins for the board.

mod routed;
mod timers;

use std::fmt::Write;

use crate::board::{Board, Units};
use crate::file::{ActuatorWire, SensorBy, SensorWire, Wiring};
use crate::signals::Signals;

/// A file of a project's `boards/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Path from the project's root.
    pub path: String,
    /// Rust.
    pub text: String,
}

/// Scales and pins of a wiring that [`check`](crate::check) passes, in the order of the signals.
/// A signal without a wire is left out: the firmware then does not compile.
pub fn sources(wiring: &Wiring, signals: &Signals, board: &Board) -> [SourceFile; 2] {
    let sensors: Vec<&SensorWire> = signals
        .sensors
        .iter()
        .filter_map(|signal| wiring.sensors.iter().find(|w| w.column == signal.name))
        .collect();
    let actuators: Vec<&ActuatorWire> = signals
        .actuators
        .iter()
        .filter_map(|signal| wiring.actuators.iter().find(|w| w.input == signal.name))
        .collect();
    [
        SourceFile {
            path: "boards/runtime/src/scales.rs".into(),
            text: scales(&sensors, &actuators),
        },
        SourceFile {
            path: format!("boards/{}/src/pins.rs", board.name),
            text: match board.units {
                Units::Timers => timers::pins(&sensors, &actuators, board),
                Units::Routed { units, .. } => routed::pins(&sensors, &actuators, board, units),
            },
        },
    ]
}

/// A number as Rust writes an `f32`.
fn number(value: f64) -> String {
    format!("{:?}", value as f32)
}

// Writing to a String cannot fail.
fn scales(sensors: &[&SensorWire], actuators: &[&ActuatorWire]) -> String {
    let is_encoder = |wire: &&SensorWire| matches!(wire.by, SensorBy::Encoder { .. });
    let encoder = if sensors.iter().any(is_encoder) {
        "Encoder, "
    } else {
        ""
    };
    let mut text = format!(
        "//! Physical values behind counts, codes and duties: printed from the rig's wiring.\n\
         \n\
         use model::control::NU;\n\
         use sinew_device::converter::{{{encoder}Scale, Span}};\n\
         \n\
         use crate::wiring::SENSORS;\n\
         \n\
         /// Scale of each sensor.\n\
         pub const SENSOR_SCALES: [Scale; SENSORS] = [\n",
    );
    for wire in sensors {
        let _ = write!(text, "    // {}\n    ", comment(&wire.column));
        let _ = match &wire.by {
            SensorBy::Analogue {
                at_zero, at_full, ..
            } => writeln!(
                text,
                "Scale::Converter(Span {{ zero: {}, full: {} }}),",
                number(*at_zero),
                number(*at_full)
            ),
            SensorBy::Encoder {
                counts_per_unit,
                at_start,
                ..
            } => writeln!(
                text,
                "Scale::Encoder(Encoder {{ unit_per_count: {}, start: {} }}),",
                number(1.0 / counts_per_unit),
                number(*at_start)
            ),
        };
    }
    text.push_str("];\n\n/// Physical values of each actuator's duty.\n");
    text.push_str("pub const ACTUATOR_SPANS: [Span; NU] = [\n");
    for wire in actuators {
        let _ = writeln!(
            text,
            "    // {}\n    Span {{ zero: {}, full: {} }},",
            comment(&wire.input),
            number(wire.at_zero),
            number(wire.at_full)
        );
    }
    text + "];\n"
}

/// A name for the end of a comment: one line.
fn comment(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// Opening of `pins.rs`, up to the parts that the board's `Wired` has.
fn opening(sensors: &[&SensorWire], actuators: &[&ActuatorWire]) -> String {
    format!(
        "//! Pins of the rig's sensors and actuators: printed from its wiring.\n\
         \n\
         /// Sensors that are wired.\n\
         pub const SENSORS_WIRED: usize = {};\n\
         /// Actuators that are wired.\n\
         pub const ACTUATORS_WIRED: usize = {};\n",
        sensors.len(),
        actuators.len()
    )
}

/// Head of the macro that claims the pins.
const CLAIM: &str = "\n\
     /// Claims the pins of the peripherals `p`, and starts what reads and drives them.\n\
     macro_rules! wired {\n    ($p:ident) => {\n        $crate::drivers::Wired {\n";

/// End of that macro.
const CLAIMED: &str = "        }\n    };\n}\npub(crate) use wired;\n";
