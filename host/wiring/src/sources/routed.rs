//! `pins.rs` of a board that routes its units to any pin.

use std::fmt::Write;

use super::{CLAIM, CLAIMED, comment, opening};
use crate::board::Board;
use crate::file::{ActuatorBy, ActuatorWire, SensorBy, SensorWire};
use crate::units::{Place, Work, places};

/// A pin as the HAL names it: `P0_03` for `P0.03`.
fn hal(pin: &str) -> String {
    pin.replace('.', "_")
}

// Writing to a String cannot fail.
pub(super) fn pins(
    sensors: &[&SensorWire],
    actuators: &[&ActuatorWire],
    board: &Board,
    units: usize,
) -> String {
    let analogue: Vec<&str> = sensors
        .iter()
        .filter_map(|wire| match &wire.by {
            SensorBy::Analogue { pin, .. } => Some(pin.as_str()),
            SensorBy::Encoder { .. } => None,
        })
        .collect();
    let mut text = opening(sensors, actuators);
    let _ = writeln!(
        text,
        "/// Analogue inputs that are wired.\npub const ANALOGUE_WIRED: usize = {};",
        analogue.len()
    );
    text.push_str(CLAIM);
    text.push_str("            analogue: [\n");
    for pin in &analogue {
        let pin = hal(pin);
        let _ = writeln!(text, "                $crate::drivers::analogue($p.{pin}),");
    }
    text.push_str("            ],\n");
    let encoder = sensors.iter().find_map(|wire| match &wire.by {
        SensorBy::Encoder { pins, .. } => Some(pins),
        SensorBy::Analogue { .. } => None,
    });
    let _ = match encoder {
        Some([a, b]) => writeln!(
            text,
            "            decoder: $crate::drivers::decoder($p.QDEC, $p.{}, $p.{}),",
            hal(a),
            hal(b)
        ),
        None => writeln!(text, "            decoder: None,"),
    };
    text.push_str("            sensors: [\n");
    let mut next = 0..;
    for wire in sensors {
        let _ = writeln!(text, "                // {}", comment(&wire.column));
        let _ = match &wire.by {
            SensorBy::Analogue { .. } => writeln!(
                text,
                "                $crate::drivers::Sensor::Analogue({}),",
                next.next().unwrap_or(0)
            ),
            SensorBy::Encoder { .. } => {
                writeln!(text, "                $crate::drivers::Sensor::Encoder,")
            }
        };
    }
    let places = places(actuators, board);
    text.push_str("            ],\n            actuators: [\n");
    for (wire, place) in actuators.iter().zip(&places) {
        // A wire without a place does not pass the check.
        let Some(Place { unit, channel }) = *place else {
            continue;
        };
        let _ = writeln!(text, "                // {}", comment(&wire.input));
        let _ = match &wire.by {
            ActuatorBy::Pwm { .. } => writeln!(
                text,
                "                $crate::drivers::Actuator::Pwm({unit}, {channel}),"
            ),
            ActuatorBy::Signed { direction, .. } => writeln!(
                text,
                "                $crate::drivers::signed({unit}, {channel}, $p.{}),",
                hal(direction)
            ),
            ActuatorBy::Servo { .. } => writeln!(
                text,
                "                $crate::drivers::Actuator::Servo({unit}, {channel}),"
            ),
        };
    }
    text.push_str("            ],\n            units: [\n");
    for unit in 0..units {
        let of = actuators.iter().zip(&places);
        let of = of.filter(|(_, place)| place.is_some_and(|p| usize::from(p.unit) == unit));
        outputs(
            &mut text,
            unit,
            &of.map(|(wire, _)| *wire).collect::<Vec<_>>(),
        );
    }
    text + "            ],\n" + CLAIMED
}

/// A unit and its pins, in the order of its outputs; none where nothing is on it.
fn outputs(text: &mut String, unit: usize, wires: &[&ActuatorWire]) {
    let Some(first) = wires.first() else {
        let _ = writeln!(text, "                None,");
        return;
    };
    let pulses = match Work::of(first) {
        Work::Servo => "servos",
        Work::Power | Work::Encoder => "power",
    };
    let _ = writeln!(
        text,
        "                $crate::drivers::{pulses}(\n                    $p.PWM{unit},\n\
         {:20}[",
        ""
    );
    for wire in wires {
        let pin = hal(wire.pulse_pin());
        let _ = writeln!(text, "                        $p.{pin}.into(),");
    }
    let _ = writeln!(text, "                    ],\n                ),");
}
