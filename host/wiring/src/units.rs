//! Timers and units that several wires share: pulses of one rate, or one encoder.

use std::collections::BTreeMap;

use crate::board::{Board, Decoder, Units, Use};
use crate::checked::Checked;
use crate::file::{ActuatorBy, ActuatorWire, Fault, SensorBy, Wiring};
use crate::signals::Signals;

/// Work of one timer or unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Work {
    /// Counts an encoder.
    Encoder,
    /// Makes pulses of power stages.
    Power,
    /// Makes pulses of servos.
    Servo,
}

impl Work {
    /// Work that an actuator asks for.
    pub(crate) fn of(wire: &ActuatorWire) -> Self {
        match wire.by {
            ActuatorBy::Pwm { .. } | ActuatorBy::Signed { .. } => Self::Power,
            ActuatorBy::Servo { .. } => Self::Servo,
        }
    }

    fn words(self, board: &Board) -> String {
        match self {
            Self::Encoder => "counts an encoder".into(),
            Self::Power => format!("makes {} pulses a second", board.pwm_hz),
            Self::Servo => format!("makes {} pulses a second", board.servo_hz),
        }
    }
}

/// Output of a timer or unit, from which an actuator's pulses come. Both count as in the chip's
/// manual: timers and their channels from 1, units and their outputs from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) unit: u8,
    pub(crate) channel: u8,
}

/// Timer that counts the encoder whose signal A is on this pin.
pub(crate) fn encoder_timer(board: &Board, pin: &str) -> Option<u8> {
    let mut uses = board.pin(pin)?.uses.iter();
    uses.find_map(|of| match of {
        Use::Encoder { timer, .. } => Some(*timer),
        _ => None,
    })
}

/// Timer and channel of the pulses of a pin.
fn timer_channel(board: &Board, pin: &str) -> Option<Place> {
    let mut uses = board.pin(pin)?.uses.iter();
    uses.find_map(|of| match *of {
        Use::Pulses { timer, channel } => Some(Place {
            unit: timer,
            channel,
        }),
        _ => None,
    })
}

/// Timers that can make pulses, each once.
pub(crate) fn pulse_timers(board: &Board) -> Vec<u8> {
    let uses = board.pins.iter().flat_map(|pin| pin.uses);
    let timers = uses.filter_map(|of| match of {
        Use::Pulses { timer, .. } => Some(*timer),
        _ => None,
    });
    let mut timers: Vec<u8> = timers.collect();
    timers.sort_unstable();
    timers.dedup();
    timers
}

/// Place of each actuator's pulses, in their order. Of a wiring that [`check`](crate::check)
/// refuses: `None` where there is none.
pub(crate) fn places(actuators: &[&ActuatorWire], board: &Board) -> Vec<Option<Place>> {
    let Units::Routed {
        units, channels, ..
    } = board.units
    else {
        let pin = |wire: &&ActuatorWire| timer_channel(board, wire.pulse_pin());
        return actuators.iter().map(pin).collect();
    };
    // Power stages fill the first units, servos the ones behind.
    let is_power = |wire: &&&ActuatorWire| Work::of(wire) == Work::Power;
    let of_power = actuators.iter().filter(is_power).count().div_ceil(channels);
    let mut next = [0, of_power * channels];
    let place = |wire: &&ActuatorWire| {
        let next = &mut next[usize::from(Work::of(wire) == Work::Servo)];
        let (unit, channel) = (*next / channels, *next % channels);
        *next += 1;
        Some(Place {
            unit: u8::try_from(unit).ok().filter(|_| unit < units)?,
            channel: u8::try_from(channel).ok()?,
        })
    };
    actuators.iter().map(place).collect()
}

/// Faults of wires that want different work of one timer, or more of it than the board has.
pub(crate) fn shared(found: &mut Checked, wiring: &Wiring, signals: &Signals, board: &Board) {
    match board.units {
        Units::Timers => timers(found, wiring, board),
        Units::Routed {
            units,
            channels,
            decoder,
        } => {
            routed(found, wiring, board, units, channels);
            decoders(found, wiring, signals, board, decoder);
        }
    }
}

/// Each timer has one kind of work.
fn timers(found: &mut Checked, wiring: &Wiring, board: &Board) {
    let encoders = wiring.sensors.iter().filter_map(|wire| match &wire.by {
        SensorBy::Encoder { pins, .. } => {
            let timer = encoder_timer(board, &pins[0])?;
            Some((timer, Work::Encoder, wire.column.as_str(), wire.line))
        }
        SensorBy::Analogue { .. } => None,
    });
    let pulses = wiring.actuators.iter().filter_map(|wire| {
        let place = timer_channel(board, wire.pulse_pin())?;
        Some((place.unit, Work::of(wire), wire.input.as_str(), wire.line))
    });
    let wires: Vec<_> = encoders.chain(pulses).collect();
    let mut works: BTreeMap<u8, (Work, &str)> = BTreeMap::new();
    for (timer, work, name, _) in &wires {
        works.entry(*timer).or_insert((*work, name));
    }
    for (timer, work, name, line) in wires {
        let (has, other) = works[&timer];
        if has == work {
            continue;
        }
        let is_free = |of: Use| match (of, work) {
            (Use::Encoder { timer, .. }, Work::Encoder)
            | (Use::Pulses { timer, .. }, Work::Power | Work::Servo) => {
                works.get(&timer).is_none_or(|(has, _)| *has == work)
            }
            _ => false,
        };
        found.faults.push(Fault::new(
            Some(line),
            format!(
                "timer {timer} {} for `{other}`, and not what `{name}` needs",
                has.words(board)
            ),
            format!("a pin of another timer: {}", board.able(is_free)),
        ));
    }
}

/// There are units enough for the pulses of both rates.
fn routed(found: &mut Checked, wiring: &Wiring, board: &Board, units: usize, channels: usize) {
    let of = |work| {
        let wires = wiring.actuators.iter();
        wires.filter(|wire| Work::of(wire) == work).count()
    };
    let (power, servos) = (of(Work::Power), of(Work::Servo));
    if power.div_ceil(channels) + servos.div_ceil(channels) > units {
        found.faults.push(Fault::new(
            None,
            format!(
                "{power} power stages and {servos} servos do not fit {units} units of {channels} \
                 outputs, each of one rate, of {}",
                board.title
            ),
            "fewer actuators",
        ));
    }
}

/// One encoder, slow enough for its decoder.
fn decoders(
    found: &mut Checked,
    wiring: &Wiring,
    signals: &Signals,
    board: &Board,
    decoder: Decoder,
) {
    let mut encoders = wiring.sensors.iter().filter_map(|wire| match wire.by {
        SensorBy::Encoder {
            counts_per_unit, ..
        } => Some((wire, counts_per_unit.abs())),
        SensorBy::Analogue { .. } => None,
    });
    let Some((wire, counts_per_unit)) = encoders.next() else {
        return;
    };
    for (other, _) in encoders {
        found.faults.push(Fault::new(
            Some(other.line),
            format!(
                "the one decoder of {} counts `{}` already",
                board.title, wire.column
            ),
            "by = \"adc\", or another board",
        ));
    }
    let edges_hz = 1.0 / decoder.look_s;
    let held_s = decoder.holds * decoder.look_s;
    if signals.rate_hz * held_s < 1.0 {
        found.faults.push(Fault::new(
            Some(wire.line),
            format!(
                "the decoder holds {} edges, which may come in {:.0} ms of a period of {:.0} ms",
                decoder.holds,
                1e3 * held_s,
                1e3 / signals.rate_hz
            ),
            "a higher rate_hz",
        ));
    }
    if counts_per_unit.is_normal() {
        let signal = signals.sensors.iter().find(|s| s.name == wire.column);
        let unit = signal.map_or("", |signal| signal.unit.as_str());
        found.remarks.push(format!(
            "`{}`: the decoder sees {edges_hz:.0} edges a second at most, a speed of {:.3e} \
             {unit}/s",
            wire.column,
            edges_hz / counts_per_unit
        ));
    }
}
