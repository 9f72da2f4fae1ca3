//! A wiring against the signals of a controller and the pins of its board.

use std::collections::BTreeMap;

use crate::board::{Board, Units, Use};
use crate::checked::Checked;
use crate::file::{ActuatorBy, ActuatorWire, Fault, SensorBy, SensorWire, Wiring};
use crate::signals::{Signal, Signals};
use crate::units;

/// Part of the period that the converter may take before it is said.
const SHARE_SAID: f64 = 0.2;

/// Everything that is wrong with a wiring: signals without a pin or with two, pins that are not
/// there, that are taken or that cannot do it, timers that would have to do two things, scales that
/// are none, a converter slower than the loop.
pub fn check(wiring: &Wiring, signals: &Signals, board: &Board) -> Checked {
    let mut found = Checked::default();
    let sensors: Vec<_> = wiring.sensors.iter().map(|w| (&w.column, w.line)).collect();
    named(&mut found, "sensor", "column", &sensors, &signals.sensors);
    let actuators: Vec<_> = wiring
        .actuators
        .iter()
        .map(|w| (&w.input, w.line))
        .collect();
    named(
        &mut found,
        "actuator",
        "input",
        &actuators,
        &signals.actuators,
    );
    pins(&mut found, wiring, board);
    wiring
        .sensors
        .iter()
        .for_each(|wire| sensor(&mut found, wire, board));
    for wire in &wiring.actuators {
        let of = signals.actuators.iter().find(|s| s.name == wire.input);
        actuator(&mut found, wire, of, signals.rate_hz, board);
    }
    units::shared(&mut found, wiring, signals, board);
    speed(&mut found, wiring, signals, board);
    found
}

/// Each signal has one wire, and each wire a signal.
fn named(
    found: &mut Checked,
    kind: &str,
    key: &str,
    wires: &[(&String, usize)],
    signals: &[Signal],
) {
    let names = || {
        signals
            .iter()
            .map(|s| s.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    for (name, line) in wires {
        if !signals.iter().any(|signal| signal.name == **name) {
            let message = format!("{key} = \"{name}\" is no {kind} of this controller");
            let expected = if signals.is_empty() {
                format!("no [[{kind}]]")
            } else {
                format!("one of {}", names())
            };
            found
                .faults
                .push(Fault::new(Some(*line), message, expected));
        }
    }
    for signal in signals {
        let lines: Vec<usize> = wires
            .iter()
            .filter(|(name, _)| **name == signal.name)
            .map(|(_, line)| *line)
            .collect();
        match lines[..] {
            [] => found.faults.push(Fault::new(
                None,
                format!("`{}` is not wired", signal.name),
                format!("a [[{kind}]] with {key} = \"{}\"", signal.name),
            )),
            [_] => {}
            [first, second, ..] => found.faults.push(Fault::new(
                Some(second),
                format!("`{}` is wired on line {first} already", signal.name),
                "one wire for a signal",
            )),
        }
    }
}

/// Each pin is there, free, and used once.
fn pins(found: &mut Checked, wiring: &Wiring, board: &Board) {
    let of_sensors = wiring
        .sensors
        .iter()
        .map(|w| (w.column.as_str(), w.line, w.pins()));
    let of_actuators = wiring
        .actuators
        .iter()
        .map(|w| (w.input.as_str(), w.line, w.pins()));
    let mut users: BTreeMap<&str, &str> = BTreeMap::new();
    for (name, line, pins) in of_sensors.chain(of_actuators) {
        for pin in pins {
            let mut fault = |message: String, expected: String| {
                found.faults.push(Fault::new(Some(line), message, expected));
            };
            if let Some((_, purpose)) = board.taken.iter().find(|(taken, _)| *taken == pin) {
                fault(format!("{pin} is taken by {purpose}"), "another pin".into());
            } else if board.pin(pin).is_none() {
                let all = board.able(|_| true);
                fault(
                    format!("{} has no pin `{pin}` to wire", board.title),
                    format!("one of {all}"),
                );
            } else if let Some(other) = users.insert(pin, name) {
                fault(
                    format!("{pin} is wired to `{other}` already"),
                    "another pin".into(),
                );
            }
        }
    }
}

/// The pin can do it; silent about a pin that is not there, which [`pins`] says.
fn able(
    found: &mut Checked,
    board: &Board,
    (pin, line): (&str, usize),
    what: &str,
    able: impl Fn(Use) -> bool,
) {
    let Some(there) = board.pin(pin) else { return };
    if !there.uses.iter().any(|of| able(*of)) {
        let message = format!("{pin} is no {what} of {}", board.title);
        let expected = format!("one of {}", board.able(able));
        found.faults.push(Fault::new(Some(line), message, expected));
    }
}

/// Two physical values that span something.
fn span(found: &mut Checked, name: &str, line: usize, ends: [f64; 2]) {
    if ends.iter().any(|end| !end.is_finite()) {
        found.faults.push(Fault::new(
            Some(line),
            format!("the scale of `{name}` is not given"),
            "numbers for at_zero and at_full, the physical values of the ends",
        ));
    } else if let Some(end) = ends.into_iter().find(|end| !is_f32(*end)) {
        found.faults.push(beyond(name, line, end));
    } else if ends[0] as f32 == ends[1] as f32 {
        found.faults.push(Fault::new(
            Some(line),
            format!(
                "at_zero and at_full of `{name}` are both {:?}",
                ends[0] as f32
            ),
            "two values that differ as f32, which the firmware computes with; the larger may come \
             first",
        ));
    }
}

/// The firmware can hold it: neither infinite nor 0 as an f32 where it is not.
fn is_f32(value: f64) -> bool {
    (value as f32).is_finite() && (value == 0.0 || (value as f32).is_normal())
}

fn beyond(name: &str, line: usize, value: f64) -> Fault {
    Fault::new(
        Some(line),
        format!("the scale of `{name}` has {value:e}, which no f32 holds"),
        "a number that the firmware can compute with, 1.2e-38 to 3.4e38",
    )
}

fn sensor(found: &mut Checked, wire: &SensorWire, board: &Board) {
    match &wire.by {
        SensorBy::Analogue {
            pin,
            at_zero,
            at_full,
        } => {
            let is_input = |of| of == Use::Analogue;
            able(found, board, (pin, wire.line), "analogue input", is_input);
            span(found, &wire.column, wire.line, [*at_zero, *at_full]);
        }
        SensorBy::Encoder {
            pins,
            counts_per_unit,
            at_start,
        } => {
            encoder(found, wire.line, pins, board);
            if !counts_per_unit.is_normal() || !at_start.is_finite() {
                found.faults.push(Fault::new(
                    Some(wire.line),
                    format!("the scale of `{}` is not given", wire.column),
                    "numbers for counts_per_unit (not 0) and at_start",
                ));
            } else if let Some(value) = [1.0 / counts_per_unit, *counts_per_unit, *at_start]
                .into_iter()
                .find(|value| !is_f32(*value))
            {
                found.faults.push(beyond(&wire.column, wire.line, value));
            }
        }
    }
}

/// Both signals of one timer, A first; any two pins of a board that routes them.
fn encoder(found: &mut Checked, line: usize, pins: &[String; 2], board: &Board) {
    if let Units::Routed { .. } = board.units {
        let is_input = |of| of == Use::Routed;
        for pin in pins {
            able(found, board, (pin, line), "input of the decoder", is_input);
        }
        return;
    }
    let timer = |pin: &str, wanted: u8| {
        let uses = board.pin(pin)?.uses.iter();
        uses.copied().find_map(|of| match of {
            Use::Encoder { timer, phase } if phase == wanted => Some(timer),
            _ => None,
        })
    };
    if pins.iter().any(|pin| board.pin(pin).is_none()) {
        return;
    }
    let (first, second) = (timer(&pins[0], 1), timer(&pins[1], 2));
    if first.is_some() && first == second {
        return;
    }
    let pairs = encoder_pairs(board).map(|[a, b]| format!("[\"{a}\", \"{b}\"]"));
    found.faults.push(Fault::new(
        Some(line),
        format!("{} and {} are not A and B of one timer", pins[0], pins[1]),
        format!("one of {}", pairs.collect::<Vec<_>>().join(", ")),
    ));
}

/// Pins of each timer that counts an encoder, A first.
pub(crate) fn encoder_pairs(board: &Board) -> impl Iterator<Item = [&'static str; 2]> + '_ {
    board.pins.iter().flat_map(|first| {
        first.uses.iter().filter_map(|of| {
            let Use::Encoder { timer, phase: 1 } = *of else {
                return None;
            };
            let is_other = |of: &Use| *of == Use::Encoder { timer, phase: 2 };
            let second = board
                .pins
                .iter()
                .find(|pin| pin.uses.iter().any(is_other))?;
            Some([first.name, second.name])
        })
    })
}

fn actuator(
    found: &mut Checked,
    wire: &ActuatorWire,
    signal: Option<&Signal>,
    rate_hz: f64,
    board: &Board,
) {
    let line = wire.line;
    match &wire.by {
        ActuatorBy::Pwm { pin } => {
            able(found, board, (pin, line), "PWM output", Use::is_pulses);
        }
        ActuatorBy::Signed { pin, direction } => {
            able(found, board, (pin, line), "PWM output", Use::is_pulses);
            able(
                found,
                board,
                (direction, line),
                "output of a bit",
                Use::is_bit,
            );
            if wire.at_zero.is_finite() && wire.at_zero != -wire.at_full {
                found.faults.push(Fault::new(
                    Some(line),
                    format!(
                        "the sign of `{}` would change at {}",
                        wire.input,
                        0.5 * (wire.at_zero + wire.at_full)
                    ),
                    "at_zero = -at_full with by = \"signed\"",
                ));
            }
        }
        ActuatorBy::Servo { pin } => {
            able(found, board, (pin, line), "servo output", Use::is_pulses);
            if rate_hz > board.servo_hz {
                found.remarks.push(format!(
                    "`{}`: a servo takes a position {} times a second, the controller commands \
                     {rate_hz} times",
                    wire.input, board.servo_hz
                ));
            }
        }
    }
    let ends = [wire.at_zero, wire.at_full];
    span(found, &wire.input, line, ends);
    let Some(Signal {
        range: Some([low, high]),
        unit,
        ..
    }) = signal
    else {
        return;
    };
    let (bottom, top) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    if bottom > *low || top < *high {
        found.faults.push(Fault::new(
            Some(line),
            format!(
                "`{}` goes from {low} to {high} {unit}, its wire from {bottom} to {top}",
                wire.input
            ),
            "a scale that holds the limits, or narrower limits in the rig",
        ));
    }
}

/// Time of the converter beside the period of the loop.
fn speed(found: &mut Checked, wiring: &Wiring, signals: &Signals, board: &Board) {
    let is_analogue = |wire: &&SensorWire| matches!(wire.by, SensorBy::Analogue { .. });
    let inputs = wiring.sensors.iter().filter(is_analogue).count();
    let share = inputs as f64 * board.conversion_s * signals.rate_hz;
    let said = format!(
        "{inputs} analogue inputs take {:.0} us of a period of {:.0} us",
        1e6 * inputs as f64 * board.conversion_s,
        1e6 / signals.rate_hz
    );
    if share >= 1.0 {
        let expected = "a lower rate_hz, or fewer analogue inputs";
        found.faults.push(Fault::new(None, said, expected));
    } else if share > SHARE_SAID {
        found.remarks.push(said);
    }
}
