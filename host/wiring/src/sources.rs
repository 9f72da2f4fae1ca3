//! Sources in which a wired board differs: scales for the runtime, pins for the board.

use std::fmt::Write;

use crate::board::{Board, Use};
use crate::file::{ActuatorBy, ActuatorWire, SensorBy, SensorWire, Wiring};
use crate::signals::Signals;

/// Channels of a timer.
const CHANNELS: u8 = 4;

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
            text: pins(&sensors, &actuators, board),
        },
    ]
}

/// A number as Rust writes an `f32`.
fn number(value: f64) -> String {
    format!("{:?}", value as f32)
}

// Writing to a String cannot fail.
fn scales(sensors: &[&SensorWire], actuators: &[&ActuatorWire]) -> String {
    let mut text = String::from(
        "//! Physical values behind counts, codes and duties: printed from the rig's wiring.\n\
         \n\
         use model::control::NU;\n\
         use sinew_device::converter::{Encoder, Scale, Span};\n\
         \n\
         use crate::wiring::SENSORS;\n\
         \n\
         /// Scale of each sensor.\n\
         pub const SENSOR_SCALES: [Scale; SENSORS] = [\n",
    );
    for wire in sensors {
        let _ = write!(text, "    // {}\n    ", wire.column);
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
            wire.input,
            number(wire.at_zero),
            number(wire.at_full)
        );
    }
    text + "];\n"
}

fn pins(sensors: &[&SensorWire], actuators: &[&ActuatorWire], board: &Board) -> String {
    let mut text = format!(
        "//! Pins of the rig's sensors and actuators: printed from its wiring.\n\
         \n\
         /// Sensors that are wired.\n\
         pub const SENSORS_WIRED: usize = {};\n\
         /// Actuators that are wired.\n\
         pub const ACTUATORS_WIRED: usize = {};\n\
         \n\
         /// Claims the pins of the peripherals `p`, and starts what reads and drives them.\n\
         macro_rules! wired {{\n    ($p:ident) => {{\n        $crate::drivers::Wired {{\n",
        sensors.len(),
        actuators.len()
    );
    text.push_str("            sensors: [\n");
    for wire in sensors {
        let _ = writeln!(text, "                // {}", wire.column);
        let _ = match &wire.by {
            SensorBy::Analogue { pin, .. } => {
                writeln!(text, "                $crate::drivers::analogue($p.{pin}),")
            }
            SensorBy::Encoder { pins: [a, b], .. } => {
                let n = timer(board, a);
                writeln!(
                    text,
                    "                $crate::drivers::encoder{n}($p.TIM{n}, $p.{a}, $p.{b}),"
                )
            }
        };
    }
    text.push_str("            ],\n            actuators: [\n");
    for wire in actuators {
        let _ = writeln!(text, "                // {}", wire.input);
        let _ = match &wire.by {
            ActuatorBy::Pwm { pin } => {
                writeln!(
                    text,
                    "                $crate::drivers::Actuator::Pwm({}),",
                    channel(board, pin)
                )
            }
            ActuatorBy::Signed { pin, direction } => writeln!(
                text,
                "                $crate::drivers::signed({}, $p.{direction}),",
                channel(board, pin)
            ),
            ActuatorBy::Servo { pin } => {
                writeln!(
                    text,
                    "                $crate::drivers::Actuator::Servo({}),",
                    channel(board, pin)
                )
            }
        };
    }
    text.push_str("            ],\n");
    let pulsed = actuators.iter().filter_map(|wire| match &wire.by {
        ActuatorBy::Pwm { pin } | ActuatorBy::Signed { pin, .. } => Some(pin.as_str()),
        ActuatorBy::Servo { .. } => None,
    });
    let servos = actuators.iter().filter_map(|wire| match &wire.by {
        ActuatorBy::Servo { pin } => Some(pin.as_str()),
        _ => None,
    });
    outputs(
        &mut text,
        "pwm",
        board.pwm,
        &pulsed.collect::<Vec<_>>(),
        board,
    );
    outputs(
        &mut text,
        "servo",
        board.servo,
        &servos.collect::<Vec<_>>(),
        board,
    );
    text.push_str("        }\n    };\n}\npub(crate) use wired;\n");
    text
}

/// The timer of these outputs, or none.
fn outputs(text: &mut String, timer: &str, peripheral: &str, pins: &[&str], board: &Board) {
    if pins.is_empty() {
        let _ = writeln!(text, "            {timer}: None,");
        return;
    }
    let _ = writeln!(
        text,
        "            {timer}: $crate::drivers::{timer}(\n                $p.{peripheral},"
    );
    for wanted in 0..CHANNELS {
        let pin = pins.iter().find(|pin| channel(board, pin) == wanted);
        let _ = match pin {
            Some(pin) => writeln!(text, "                $crate::drivers::output($p.{pin}),"),
            None => writeln!(text, "                None,"),
        };
    }
    let _ = writeln!(text, "            ),");
}

/// Timer that counts the encoder whose signal A is on this pin; 0 of a pin that is none.
fn timer(board: &Board, pin: &str) -> u8 {
    let mut uses = board.pin(pin).into_iter().flat_map(|pin| pin.uses);
    let found = uses.find_map(|of| match of {
        Use::Encoder { timer, .. } => Some(*timer),
        _ => None,
    });
    found.unwrap_or(0)
}

/// Channel of an output, from 0.
fn channel(board: &Board, pin: &str) -> u8 {
    let mut uses = board.pin(pin).into_iter().flat_map(|pin| pin.uses);
    let found = uses.find_map(|of| match of {
        Use::Pwm { channel } | Use::Servo { channel } => Some(channel - 1),
        _ => None,
    });
    found.unwrap_or(0)
}
