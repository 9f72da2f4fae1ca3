//! `pins.rs` of a board whose pins belong to timers.

use std::fmt::Write;

use super::{CLAIM, CLAIMED, comment, opening};
use crate::board::Board;
use crate::file::{ActuatorBy, ActuatorWire, SensorBy, SensorWire};
use crate::units::{Place, Work, encoder_timer, places, pulse_timers};

/// Channels of a timer.
const CHANNELS: u8 = 4;

// Writing to a String cannot fail.
pub(super) fn pins(sensors: &[&SensorWire], actuators: &[&ActuatorWire], board: &Board) -> String {
    let mut text = opening(sensors, actuators);
    text.push_str(CLAIM);
    text.push_str("            sensors: [\n");
    for wire in sensors {
        let _ = writeln!(text, "                // {}", comment(&wire.column));
        let _ = match &wire.by {
            SensorBy::Analogue { pin, .. } => {
                writeln!(text, "                $crate::drivers::analogue($p.{pin}),")
            }
            SensorBy::Encoder { pins: [a, b], .. } => {
                let n = encoder_timer(board, a).unwrap_or(0);
                writeln!(
                    text,
                    "                $crate::drivers::encoder{n}($p.TIM{n}, $p.{a}, $p.{b}),"
                )
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
        let output = format!("$crate::drivers::Timer::Tim{unit}, {}", channel - 1);
        let _ = writeln!(text, "                // {}", comment(&wire.input));
        let _ = match &wire.by {
            ActuatorBy::Pwm { .. } => writeln!(
                text,
                "                $crate::drivers::Actuator::Pwm({output}),"
            ),
            ActuatorBy::Signed { direction, .. } => writeln!(
                text,
                "                $crate::drivers::signed({output}, $p.{direction}),"
            ),
            ActuatorBy::Servo { .. } => writeln!(
                text,
                "                $crate::drivers::Actuator::Servo({output}),"
            ),
        };
    }
    text.push_str("            ],\n            timers: $crate::drivers::Timers {\n");
    for timer in pulse_timers(board) {
        let of = actuators.iter().zip(&places);
        let of = of.filter_map(|(wire, place)| Some((*wire, (*place)?)));
        let of: Vec<_> = of.filter(|(_, place)| place.unit == timer).collect();
        outputs(&mut text, timer, &of);
    }
    text + "            },\n" + CLAIMED
}

/// A timer and the pins of its channels; none where nothing is on it.
fn outputs(text: &mut String, timer: u8, wires: &[(&ActuatorWire, Place)]) {
    let Some((first, _)) = wires.first() else {
        let _ = writeln!(text, "                tim{timer}: None,");
        return;
    };
    let rate = match Work::of(first) {
        Work::Servo => "SERVO_HZ",
        Work::Power | Work::Encoder => "PWM_HZ",
    };
    let _ = writeln!(
        text,
        "                tim{timer}: $crate::drivers::pulses(\n                    \
         $crate::drivers::{rate},\n                    $p.TIM{timer},"
    );
    for wanted in 1..=CHANNELS {
        let wire = wires.iter().find(|(_, place)| place.channel == wanted);
        let _ = match wire {
            Some((wire, _)) => writeln!(
                text,
                "                    $crate::drivers::output($p.{}),",
                wire.pulse_pin()
            ),
            None => writeln!(text, "                    None,"),
        };
    }
    let _ = writeln!(text, "                ),");
}
