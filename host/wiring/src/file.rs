//! The file: `wiring.toml`, format `sinew-wiring/1`.

use std::fmt;

use serde::Deserialize;
use toml::Spanned;

/// The only format.
const FORMAT: &str = "sinew-wiring/1";

/// A place of a wiring file that cannot be used, and the remedy. Without a line: a signal that the
/// file does not name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Line, from 1.
    pub line: Option<usize>,
    /// Fault in words.
    pub message: String,
    /// Contents that would be right.
    pub expected: String,
}

impl Fault {
    pub(crate) fn new(
        line: Option<usize>,
        message: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self {
            line,
            message: message.into(),
            expected: expected.into(),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        write!(f, "{}; expected {}", self.message, self.expected)
    }
}

impl std::error::Error for Fault {}

/// Wiring of a rig to a board, as its file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Wiring {
    /// Name of the board.
    pub board: String,
    /// Line of that name.
    pub board_line: usize,
    /// Sensors, in the file's order.
    pub sensors: Vec<SensorWire>,
    /// Actuators, in the file's order.
    pub actuators: Vec<ActuatorWire>,
}

/// One sensor's pins and scale.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorWire {
    /// Column of the recording.
    pub column: String,
    /// Way in which it is read.
    pub by: SensorBy,
    /// Line of its table in the file.
    pub line: usize,
}

/// Way in which a sensor is read.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorBy {
    /// A voltage.
    Analogue {
        /// The pin.
        pin: String,
        /// Physical value at code 0.
        at_zero: f64,
        /// Physical value at the largest code.
        at_full: f64,
    },
    /// A quadrature encoder, counted at each edge of both signals.
    Encoder {
        /// Signals A and B.
        pins: [String; 2],
        /// Counts of one physical unit; negative where it counts backwards.
        counts_per_unit: f64,
        /// Physical value where the board starts.
        at_start: f64,
    },
}

/// One actuator's pins and scale.
#[derive(Clone, Debug, PartialEq)]
pub struct ActuatorWire {
    /// Column of the recording.
    pub input: String,
    /// Way in which it is driven.
    pub by: ActuatorBy,
    /// Physical value of the smallest duty or the shortest pulse.
    pub at_zero: f64,
    /// Physical value of the largest duty or the longest pulse.
    pub at_full: f64,
    /// Line of its table in the file.
    pub line: usize,
}

/// Way in which an actuator is driven.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ActuatorBy {
    /// Pulses of a width from nothing to the whole period.
    Pwm {
        /// The pin.
        pin: String,
    },
    /// Pulses for the size of the command, a bit for its sign: a half bridge.
    Signed {
        /// Pin of the pulses.
        pin: String,
        /// Pin of the sign: low below the middle of the scale.
        direction: String,
    },
    /// Pulses of 1 to 2 ms for a hobby servo.
    Servo {
        /// The pin.
        pin: String,
    },
}

impl Wiring {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// The first thing that is wrong with it as a file; whether it fits a rig is for
    /// [`check`](crate::check) to say.
    pub fn parse(text: &str) -> Result<Self, Fault> {
        let line = |at: usize| 1 + text[..at.min(text.len())].matches('\n').count();
        let read: Document = toml::from_str(text).map_err(|error| {
            let at = error.span().map(|span| line(span.start));
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            Fault::new(at, message, "the keys of docs/reference/wiring.md")
        })?;
        if read.format.get_ref() != FORMAT {
            return Err(Fault::new(
                Some(line(read.format.span().start)),
                format!("the format is `{}`", read.format.get_ref()),
                format!("format = \"{FORMAT}\""),
            ));
        }
        let sensors = read.sensor.into_iter().map(|table| {
            let at = line(table.span().start);
            sensor(table.into_inner(), at)
        });
        let actuators = read.actuator.into_iter().map(|table| {
            let at = line(table.span().start);
            actuator(table.into_inner(), at)
        });
        Ok(Self {
            board_line: line(read.board.span().start),
            board: read.board.into_inner(),
            sensors: sensors.collect::<Result<_, _>>()?,
            actuators: actuators.collect::<Result<_, _>>()?,
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: Spanned<String>,
    board: Spanned<String>,
    #[serde(default)]
    sensor: Vec<Spanned<SensorTable>>,
    #[serde(default)]
    actuator: Vec<Spanned<ActuatorTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorTable {
    column: String,
    by: String,
    pin: Option<String>,
    pins: Option<[String; 2]>,
    at_zero: Option<f64>,
    at_full: Option<f64>,
    counts_per_unit: Option<f64>,
    at_start: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ActuatorTable {
    input: String,
    by: String,
    pin: String,
    direction: Option<String>,
    at_zero: f64,
    at_full: f64,
}

/// A key that the table needs.
fn needed<T>(value: Option<T>, key: &str, by: &str, line: usize) -> Result<T, Fault> {
    value.ok_or_else(|| {
        let message = format!("`{key}` is missing");
        Fault::new(Some(line), message, format!("it, since by = \"{by}\""))
    })
}

/// Keys that the table has and that mean nothing there.
fn idle(keys: &[(&str, bool)], by: &str, line: usize) -> Result<(), Fault> {
    match keys.iter().find(|(_, there)| *there) {
        None => Ok(()),
        Some((key, _)) => Err(Fault::new(
            Some(line),
            format!("`{key}` means nothing with by = \"{by}\""),
            "the keys of docs/reference/wiring.md",
        )),
    }
}

fn sensor(table: SensorTable, line: usize) -> Result<SensorWire, Fault> {
    let by = table.by.as_str();
    let is_there = [
        ("pin", table.pin.is_some()),
        ("at_zero", table.at_zero.is_some()),
        ("at_full", table.at_full.is_some()),
        ("pins", table.pins.is_some()),
        ("counts_per_unit", table.counts_per_unit.is_some()),
        ("at_start", table.at_start.is_some()),
    ];
    let by = match by {
        "adc" => {
            idle(&is_there[3..], by, line)?;
            SensorBy::Analogue {
                pin: needed(table.pin, "pin", by, line)?,
                at_zero: needed(table.at_zero, "at_zero", by, line)?,
                at_full: needed(table.at_full, "at_full", by, line)?,
            }
        }
        "encoder" => {
            idle(&is_there[..3], by, line)?;
            SensorBy::Encoder {
                pins: needed(table.pins, "pins", by, line)?,
                counts_per_unit: needed(table.counts_per_unit, "counts_per_unit", by, line)?,
                at_start: needed(table.at_start, "at_start", by, line)?,
            }
        }
        _ => {
            let message = format!("by = \"{by}\" is no way to read a sensor");
            return Err(Fault::new(Some(line), message, "adc or encoder"));
        }
    };
    Ok(SensorWire {
        column: table.column,
        by,
        line,
    })
}

fn actuator(table: ActuatorTable, line: usize) -> Result<ActuatorWire, Fault> {
    let by = table.by.as_str();
    let pin = table.pin;
    if by != "signed" {
        idle(&[("direction", table.direction.is_some())], by, line)?;
    }
    let by = match by {
        "pwm" => ActuatorBy::Pwm { pin },
        "servo" => ActuatorBy::Servo { pin },
        "signed" => ActuatorBy::Signed {
            pin,
            direction: needed(table.direction, "direction", by, line)?,
        },
        _ => {
            let message = format!("by = \"{by}\" is no way to drive an actuator");
            return Err(Fault::new(Some(line), message, "pwm, signed or servo"));
        }
    };
    Ok(ActuatorWire {
        input: table.input,
        by,
        at_zero: table.at_zero,
        at_full: table.at_full,
        line,
    })
}

impl SensorWire {
    /// Its pins.
    pub fn pins(&self) -> Vec<&str> {
        match &self.by {
            SensorBy::Analogue { pin, .. } => vec![pin],
            SensorBy::Encoder { pins, .. } => pins.iter().map(String::as_str).collect(),
        }
    }
}

impl ActuatorWire {
    /// Its pins.
    pub fn pins(&self) -> Vec<&str> {
        match &self.by {
            ActuatorBy::Pwm { pin } | ActuatorBy::Servo { pin } => vec![pin],
            ActuatorBy::Signed { pin, direction } => vec![pin, direction],
        }
    }

    /// Pin of its pulses.
    pub fn pulse_pin(&self) -> &str {
        match &self.by {
            ActuatorBy::Pwm { pin }
            | ActuatorBy::Servo { pin }
            | ActuatorBy::Signed { pin, .. } => pin,
        }
    }
}
