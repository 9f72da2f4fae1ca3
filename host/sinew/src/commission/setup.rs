//! Signals of a rig on its board, before anything is known of them but what the rig declares.

use std::path::Path;

use sinew_model::spec::{Activation, limits::MAX_SIGNALS};
use sinew_model::spec::{ControlSpec, Dense, Layer, ModelSpec, OutputForm, Signal};
use sinew_sim::{Input, Plant, Rig, Stepper};

use crate::pipeline::learned::{crate_name, unit_of};
use crate::project::wired;
use crate::rig_file::ControlTable;
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::{Column, Recording};

/// Part of the slow triangle from whose readings the ranges of sensors are taken, seconds.
const TRIANGLE_S: f64 = 8.0;
/// Range of a sensor of the bare model, in half ranges that the rig predicts: what is declared may
/// be wrong by as much before a reading leaves the converter.
const HEADROOM: f64 = 2.0;

/// An input of the rig, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Column of a recording.
    pub column: String,
    /// Unit of its commands.
    pub unit: String,
    /// Smallest command.
    pub low: f64,
    /// Largest command.
    pub high: f64,
    /// Largest change a second; infinity for none.
    pub rate: f64,
    /// Command of a disarmed board.
    pub safe: f64,
    /// SI in one unit of the column.
    pub factor: f64,
}

impl Actuator {
    /// The command at a part of the way from the safe one to the upper (positive) or lower end.
    pub fn at(&self, part: f64) -> f64 {
        let end = if part < 0.0 { self.low } else { self.high };
        self.safe + part.abs() * (end - self.safe)
    }

    /// Inverse of [`Actuator::at`]; 0 towards an end that is the safe command itself.
    pub fn part(&self, u: f64) -> f64 {
        let (end, sign) = if u < self.safe {
            (self.low, -1.0)
        } else {
            (self.high, 1.0)
        };
        let way = (end - self.safe).abs();
        if way > 0.0 {
            sign * (u - self.safe).abs() / way
        } else {
            0.0
        }
    }

    /// True where there is room on this side (-1 or 1) of the safe command.
    pub fn has_side(&self, side: f64) -> bool {
        (self.at(side) - self.safe).abs() > 1e-3 * (self.high - self.low)
    }
}

/// A sensor that the board reads, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Column of a recording.
    pub column: String,
    /// Unit of its readings.
    pub unit: String,
    /// SI in one unit of the column.
    pub factor: f64,
    /// Index in the plant.
    pub index: usize,
}

/// Span of an input of the bare model, in half ranges. The board's supervisor calls a sensor stuck
/// that stands still while a command moves half a span. Here one actuator moves at a time, and the
/// encoders of the others rightly stand still; dead ones are found by [`super::judge`].
const INPUT_SPANS: f64 = 8.0;

/// A rig and the signals of its board.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The rig as declared.
    pub rig: Rig,
    /// The same, compiled.
    pub plant: Plant,
    /// Actuators, in the order of the board.
    pub actuators: Vec<Actuator>,
    /// Sensors, in the order of the board: outputs, then channels.
    pub sensors: Vec<Sensor>,
    /// Sensors that are outputs of the bare model; the rest are channels.
    pub outputs: usize,
    /// Sensors of the rig that the board does not read, and that nothing on it needs.
    pub unread: Vec<String>,
    /// Outputs that a soft sensor says in their place: the board does not read them either.
    pub sensed: Vec<String>,
    /// Period of the board's timer, seconds.
    pub period_s: f64,
}

/// A command range that its owner gives: column, lower, upper, in the column's unit.
pub type Range = (String, f64, f64);

/// Actuator of an input with its range of commands: the limit, or what `ranges` says within it.
fn actuator(rig: &Rig, input: &Input, ranges: &[Range]) -> Result<Actuator> {
    let given = ranges.iter().find(|(column, ..)| *column == input.column);
    let given = given.map(|(_, low, high)| (low * input.column_factor, high * input.column_factor));
    let (low, high) = match (input.limit, given) {
        (Some((least, most)), Some((low, high))) if low < least || high > most => {
            return Err(Error::must_be(
                "--range",
                format!("within the limit of `{}`, {least} to {most}", input.column),
                format!("{low}:{high}"),
            ));
        }
        (_, Some(given)) => given,
        (Some(limit), None) => limit,
        (None, None) => {
            let message = format!("actuator `{}` has no `limit`", input.actuator);
            return Err(Error::file(&rig.file, message)
                .at(input.line, 1)
                .expected("`limit = [lower, upper]`: what it may be driven with")
                .help(format!("or --range {}=LOWER:UPPER", input.column)));
        }
    };
    if !(low < high && (high - low).is_finite()) {
        return Err(Error::must_be(
            "--range",
            "NAME=LOWER:UPPER with LOWER < UPPER",
            format!("{low}:{high}"),
        ));
    }
    Ok(Actuator {
        column: input.column.clone(),
        unit: unit_of(input.unit()).into(),
        low,
        high,
        rate: input.rate_limit.unwrap_or(f64::INFINITY),
        safe: 0.0_f64.clamp(low, high),
        factor: input.column_factor,
    })
}

impl Setup {
    /// Reads what a rig declares; `ranges` narrow the commands of actuators.
    ///
    /// # Errors
    /// A rig that commands alone cannot drive, an actuator without a limit, a range that is none
    /// or lies outside the limit, more signals than a frame carries.
    pub fn new(rig: Rig, ranges: &[Range]) -> Result<Self> {
        let plant = Plant::new(&rig)?;
        if let Some(reason) = plant.only_recordings() {
            let message = format!("only a recording can drive this rig: {reason}");
            return Err(
                Error::file(&rig.file, message).expected("a rig that its actuators alone drive")
            );
        }
        if let Some((column, ..)) = ranges
            .iter()
            .find(|(column, ..)| !plant.inputs().iter().any(|i| i.column == *column))
        {
            let inputs = plant.inputs().iter().map(|i| i.column.as_str());
            return Err(
                Error::must_be("--range", "an input of the rig", column).help(format!(
                    "the rig's inputs: {}",
                    inputs.collect::<Vec<_>>().join(", ")
                )),
            );
        }
        let actuators = plant.inputs().iter();
        let actuators = actuators.map(|input| actuator(&rig, input, ranges));
        let actuators = actuators.collect::<Result<Vec<_>>>()?;
        let control = ControlTable::read(&rig)?;
        let signals = wired::of_rig(&rig)?;
        let sensors: Vec<Sensor> = (signals.sensors.iter())
            .filter_map(|signal| {
                let index = plant
                    .sensors()
                    .iter()
                    .position(|s| s.column == signal.name)?;
                let sensor = &plant.sensors()[index];
                Some(Sensor {
                    column: sensor.column.clone(),
                    unit: unit_of(&sensor.unit).into(),
                    factor: sensor.column_factor,
                    index,
                })
            })
            .collect();
        if sensors.is_empty() || actuators.is_empty() {
            return Err(Error::file(&rig.file, "the rig has nothing to commission")
                .expected("an actuator, and a sensor that the board reads"));
        }
        let outputs = match &control {
            Some(control) if control.sensed_by.is_empty() => control.outputs.len(),
            None => sensors.len(),
            Some(_) => MAX_SIGNALS,
        };
        let is_output = |k: &usize| control.as_ref().is_some_and(|c| c.outputs.contains(k));
        let (sensed, unread): (Vec<usize>, Vec<usize>) = (0..plant.sensors().len())
            .filter(|k| !sensors.iter().any(|sensor| sensor.index == *k))
            .partition(is_output);
        let columns = |indices: Vec<usize>| -> Vec<String> {
            let each = indices.iter();
            each.map(|k| plant.sensors()[*k].column.clone()).collect()
        };
        Ok(Self {
            outputs: outputs.clamp(1, MAX_SIGNALS.min(sensors.len())),
            unread: columns(unread),
            sensed: columns(sensed),
            actuators,
            sensors,
            period_s: 1.0 / signals.rate_hz,
            plant,
            rig,
        })
    }

    /// Readings that the rig predicts for commands `u`, a row a tick, from its rest at the safe
    /// commands; a column a sensor. Where it does not rest, from `first`, readings of the board.
    ///
    /// # Errors
    /// A rig that diverges.
    pub fn predict(&self, u: &[Vec<f64>], first: &[f64]) -> Result<Vec<Vec<f64>>> {
        let values = self.plant.values();
        let safe: Vec<f64> = self.actuators.iter().map(|a| a.safe).collect();
        let mut readings = vec![None; self.plant.sensors().len()];
        for (sensor, reading) in self.sensors.iter().zip(first) {
            readings[sensor.index] = Some(*reading).filter(|r| r.is_finite());
        }
        let start = self.plant.initial_state(&values, &readings)?;
        let start = match self.plant.rest(&values, &safe, &start) {
            Ok(rest) => rest.state,
            Err(_) => start,
        };
        let mut stepper = Stepper::new(&self.plant, &values, &start)?;
        stepper.hold(&safe)?;
        let mut columns = vec![Vec::with_capacity(u.len()); self.sensors.len()];
        for row in u {
            for (column, sensor) in columns.iter_mut().zip(&self.sensors) {
                column.push(stepper.signal(sensor.index));
            }
            stepper.advance(self.period_s, row)?;
        }
        Ok(columns)
    }

    /// The bare model: it predicts that every output stays, and carries the limits, the scales and
    /// the rate that the firmware of a first power-up needs.
    ///
    /// # Errors
    /// A rig that diverges, or with more signals than a frame carries.
    pub fn bare_model(&self) -> Result<ModelSpec> {
        let scales = self.scales()?;
        let signal = |(sensor, (span, offset)): (&Sensor, &(f64, f64))| Signal {
            name: sensor.column.clone(),
            unit: sensor.unit.clone(),
            span: *span,
            offset: *offset,
        };
        let signals: Vec<Signal> = self.sensors.iter().zip(&scales).map(signal).collect();
        let (n_u, n_y, n_s) = (
            self.actuators.len(),
            self.outputs,
            self.sensors.len() - self.outputs,
        );
        let regressor = n_u + n_y + n_s;
        let of = |value: fn(&Actuator) -> f64| self.actuators.iter().map(value).collect();
        let layer = Dense::from_rows(
            &vec![vec![0.0; regressor]; n_y],
            vec![0.0; n_y],
            Activation::Linear,
        )
        .map_err(Error::refused)?;
        let spec = ModelSpec {
            name: crate_name(&self.rig.name),
            period_s: self.period_s,
            inputs: (self.actuators.iter())
                .map(|a| Signal {
                    name: a.column.clone(),
                    unit: a.unit.clone(),
                    span: INPUT_SPANS * (a.high - a.low) / 2.0,
                    offset: (a.high + a.low) / 2.0,
                })
                .collect(),
            outputs: signals[..n_y].to_vec(),
            channels: signals[n_y..].to_vec(),
            past_inputs: 1,
            past_outputs: 1,
            form: OutputForm::Increment,
            skip: None,
            layers: vec![Layer::Dense(layer)],
            control: ControlSpec {
                horizon: 1,
                control_horizon: 1,
                move_blocks: vec![],
                first_step: 1,
                tracking_weight: vec![1.0; n_y],
                move_suppression: vec![1.0; n_u],
                command_weight: 0.0,
                observer_gain: 1.0,
                lower: of(|a| a.low),
                upper: of(|a| a.high),
                rate_limit: of(|a| a.rate),
                safe: of(|a| a.safe),
                disturbance_gain: 0.0,
                iterations: 1,
                budget: None,
                max_missing_samples: 12,
                value: None,
            },
            state: None,
            soft_sensor: None,
            golden: vec![],
        };
        spec.validate().map_err(|error| {
            Error::file(
                &self.rig.file,
                format!("no firmware carries this rig: {error}"),
            )
        })?;
        Ok(spec)
    }

    /// Half range and middle of each sensor, by what the rig predicts within the limits.
    fn scales(&self) -> Result<Vec<(f64, f64)>> {
        let rows = (TRIANGLE_S / self.period_s).ceil() as usize;
        let mut ends = vec![(f64::INFINITY, f64::NEG_INFINITY); self.sensors.len()];
        let n = self.actuators.len();
        // Each actuator alone, and all at once.
        for driven in 0..=n {
            let u: Vec<Vec<f64>> = (0..rows)
                .map(|k| {
                    let part = triangle(k as f64 / rows as f64);
                    let of = |(j, a): (usize, &Actuator)| {
                        if driven == n || driven == j {
                            a.at(part)
                        } else {
                            a.safe
                        }
                    };
                    self.actuators.iter().enumerate().map(of).collect()
                })
                .collect();
            let y = self.predict(&u, &[])?;
            for ((low, high), y) in ends.iter_mut().zip(&y) {
                *low = y.iter().copied().fold(*low, f64::min);
                *high = y.iter().copied().fold(*high, f64::max);
            }
        }
        let scale = |(low, high): (f64, f64)| {
            let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
            // A sensor that nothing moves has the scale of its reading.
            let least = 1e-6 * middle.abs().max(1.0);
            let span = if half > least {
                HEADROOM * half
            } else {
                middle.abs().max(1.0)
            };
            (span, middle)
        };
        Ok(ends.into_iter().map(scale).collect())
    }

    /// A recording of the board in the columns' own units.
    ///
    /// # Errors
    /// None beyond what [`Recording::new`] refuses.
    pub fn in_columns(&self, recording: &Recording, path: &Path) -> Result<Recording> {
        let factor = |name: &str| {
            let actuators = self.actuators.iter().map(|a| (&a.column, a.factor));
            let sensors = self.sensors.iter().map(|s| (&s.column, s.factor));
            let found = actuators.chain(sensors).find(|(column, _)| *column == name);
            found.map_or(1.0, |(_, factor)| factor)
        };
        let columns = recording.columns().iter().map(|column| Column {
            name: column.name.clone(),
            values: (column.values.iter())
                .map(|v| v / factor(&column.name))
                .collect(),
        });
        Recording::new(path, recording.t().to_vec(), columns.collect())
    }
}

/// Triangle of one period: 0, 1, -1, 0.
fn triangle(share: f64) -> f64 {
    let turn = 4.0 * share;
    match turn {
        t if t < 1.0 => t,
        t if t < 3.0 => 2.0 - t,
        t => t - 4.0,
    }
}
