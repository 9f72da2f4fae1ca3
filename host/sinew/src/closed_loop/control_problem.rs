//! Control problem: the rig's `[control]` table, filled in from the recordings.

use sinew_device::protocol::MAX_PREVIEW;
use sinew_model::spec::{MAX_VALUE_ROWS, Signal, ValueSpec};
use sinew_model::value;
use sinew_sim::{Plant, Rig, Stepper};
use sinew_train::{FirstLayer, Form};

use crate::closed_loop::reference::{Reference, Workspace};
use crate::closed_loop::scenario::InputLimits;
use crate::rig_file::{self, ControlTable, TerminalTable};
use sinew_ident::error::{Error, Result};
use sinew_ident::noise::noise_level;
use sinew_ident::recording::Recording;

/// Control rate where the rig names none, in hertz.
const RATE_HZ: f64 = 120.0;
/// Steps predicted where the rig names no number.
const HORIZON: usize = 10;
/// Rows of the reference behind the horizon of a controller with a cost-to-go.
const AHEAD: usize = 8;
/// Most operating points of a cost-to-go.
const POINTS: usize = 5;
/// Steps of each level of the staircase (the published experiment).
const STAIRCASE: usize = 333;
/// Part of each input's limit that a reference may need at rest: a plant a fifth stiffer still gets
/// there, with something left for moving.
const REACH: f64 = 0.7;
/// Speed of a designed reference, as a fraction of the recorded speed.
const LED: f64 = 0.25;
/// A reach smaller than this part of what was recorded is none.
const LEAST_REACH: f64 = 0.05;
/// Seconds within which a plant that settles has settled.
const SETTLING_S: f64 = 60.0;

/// Source of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Designed here: tuning follows random moves.
    Designed,
    /// A column of the recording an output: tuning follows their mirror image.
    Recorded,
    /// A file whose columns belong together: tuning follows it backwards.
    Path,
}

/// A cost-to-go at the end of the horizon (docs/explanation/controller.md, eq. 4d).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terminal {
    /// Its rows.
    pub rows: usize,
    /// Rows of the reference behind the horizon.
    pub ahead: usize,
    /// Most operating points along the reference.
    pub points: usize,
}

/// The control problem in physical units, before any weight is tuned.
#[derive(Clone, Debug)]
pub struct ControlProblem {
    /// Control period, seconds.
    pub period_s: f64,
    /// Indices of the sensors that are outputs.
    pub outputs: Vec<usize>,
    /// Steps predicted.
    pub horizon: usize,
    /// Steps with commands of their own.
    pub control_horizon: usize,
    /// Cost-to-go at the end of the horizon, where the rig asks for one.
    pub terminal: Option<Terminal>,
    /// Q, one an output.
    pub tracking_weight: Vec<f64>,
    /// Lambda where the rig fixes it; otherwise it is tuned.
    pub move_suppression: Option<Vec<f64>>,
    /// R of eq. 4c, in model units; 0: none.
    pub command_weight: f64,
    /// Lower, upper, change a period of each input.
    pub limits: Vec<InputLimits>,
    /// Half the range of each input's limits.
    pub input_range: Vec<f64>,
    /// Workspace of each output in the recordings.
    pub workspaces: Vec<Workspace>,
    /// Half the recorded range of each output.
    pub output_range: Vec<f64>,
    /// Standard deviation of each output's noise.
    pub noise: Vec<f64>,
    /// Indices of the sensors that are the model's channels: those that the network sees, or those
    /// of the soft sensor.
    pub channels: Vec<usize>,
    /// Standard deviation of each channel's noise.
    pub channel_noise: Vec<f64>,
    /// A soft sensor says the outputs, from the channels: the controller gets no reading of them.
    pub sensed: bool,
    /// Names of the parameters of sensors, which such a calibration takes as they are.
    pub calibrated: Vec<String>,
    /// First valid sample of every sensor: where a loop starts.
    pub home: Vec<Option<f64>>,
    /// Reference of the comparison, and its source.
    pub reference: Reference,
    /// Origin of the reference, which says what tuning follows instead.
    pub source: Source,
    /// Errors are judged from here to there, seconds; without, over the whole run.
    pub judged_s: Option<[f64; 2]>,
    /// Most steps that a controller without a model may look ahead; as far as the horizon, where
    /// nothing else is asked.
    pub longest_lead: usize,
    /// All outputs have one unit, so that the length of their error means something.
    pub one_unit: bool,
    /// One line that says where the reference comes from.
    pub reference_source: String,
}

impl ControlProblem {
    /// Duration of the reference.
    pub fn duration_s(&self) -> f64 {
        self.reference.steps() as f64 * self.period_s
    }

    /// The task of a rig. Ranges and noise come from `recordings`; a recorded reference from
    /// `reference`.
    ///
    /// # Errors
    /// No output, no input, an input without a limit that was never moved, a column that is not
    /// there.
    pub fn new(
        rig: &Rig,
        plant: &Plant,
        recordings: &[Recording],
        reference: &Recording,
    ) -> Result<Self> {
        let control = ControlTable::read(rig)?;
        let control = control.as_ref();
        let outputs = match control {
            Some(control) => control.outputs.clone(),
            None => position_sensors(plant),
        };
        if outputs.is_empty() {
            return Err(
                Error::file(&rig.file, "nothing to control: no sensor reads a position")
                    .expected("`outputs` in [control], or a sensor that reads BODY.position"),
            );
        }
        if plant.inputs().is_empty() {
            let message = "nothing to control with: the rig has no actuator";
            return Err(
                Error::file(&rig.file, message).expected("an [[actuator]] with its `input`")
            );
        }
        if let Some(reason) = plant.only_recordings() {
            let message = format!("nothing to control: {reason}");
            return Err(
                Error::file(&rig.file, message).expected("a rig that its actuators alone drive")
            );
        }
        let period_s = 1.0 / control.and_then(|c| c.rate_hz).unwrap_or(RATE_HZ);
        let asked_terminal = control.and_then(|c| c.terminal);
        let usual = match asked_terminal {
            Some(_) => 1,
            None => HORIZON,
        };
        let horizon = control.and_then(|c| c.horizon).unwrap_or(usual);
        let control_horizon = control
            .and_then(|c| c.control_horizon)
            .unwrap_or(3)
            .min(horizon);
        let terminal = match asked_terminal {
            Some(asked) => {
                computable(rig)?;
                let decisions = control_horizon * plant.inputs().len();
                Some(terminal(asked, horizon, decisions, outputs.len()))
            }
            None => None,
        };
        let preview = horizon + terminal.map_or(0, |terminal| terminal.ahead);
        carried(rig, period_s, (preview, terminal.is_some()), outputs.len())?;

        let column = |recording: &Recording, sensor: usize| -> Result<Vec<f64>> {
            recording.sensor(&plant.sensors()[sensor])
        };
        let mut workspaces = Vec::new();
        let mut noise = Vec::new();
        for &sensor in &outputs {
            let (mut low, mut high, mut speed, mut level) =
                (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64, f64::INFINITY);
            for recording in recordings {
                let y = column(recording, sensor)?;
                low = y.iter().copied().fold(low, f64::min);
                high = y.iter().copied().fold(high, f64::max);
                level = level.min(noise_level(recording.t(), &y));
                speed = speed.max(typical_speed(recording.t(), &y));
            }
            if high <= low {
                let first = recordings.first().map_or(reference.path(), Recording::path);
                let column = &plant.sensors()[sensor].column;
                let message = format!("`{column}` never moves, so there is nothing to learn from");
                return Err(Error::file(first, message)
                    .at(1, 1)
                    .expected("a recording in which every output moves"));
            }
            workspaces.push(Workspace { low, high, speed });
            noise.push(level);
        }
        let channels = rig_file::network_table(rig)?.map(|network| network.channels);
        let mut channels = channels.unwrap_or_default();
        let sensed = control.is_some_and(|control| !control.sensed_by.is_empty());
        if let Some(control) = control.filter(|_| sensed) {
            if !channels.is_empty() {
                let message = "`channels` of [network] beside `sensed_by` of [control]: a soft \
                               sensor takes the channels, and the network sees none";
                return Err(Error::file(&rig.file, message)
                    .at(control.line, 1)
                    .expected("one of the two"));
            }
            channels.clone_from(&control.sensed_by);
        }
        let quietest = |sensor: &usize| -> Result<f64> {
            let levels = recordings
                .iter()
                .map(|r| Ok(noise_level(r.t(), &column(r, *sensor)?)));
            let levels = levels.collect::<Result<Vec<f64>>>()?;
            Ok(levels.into_iter().fold(f64::INFINITY, f64::min))
        };
        let channel_noise = channels.iter().map(quietest).collect::<Result<Vec<_>>>()?;
        let home: Vec<Option<f64>> = (0..plant.sensors().len())
            .map(|sensor| {
                let y = column(reference, sensor)?;
                Ok(y.into_iter().find(|v| v.is_finite()))
            })
            .collect::<Result<_>>()?;

        let limits = limits(plant, recordings, period_s)?;
        let ends = [
            rest(plant, &home, &outputs, &limits, |(_, high, _)| REACH * high)?,
            rest(plant, &home, &outputs, &limits, |(low, _, _)| REACH * low)?,
        ];
        for (i, workspace) in workspaces.iter_mut().enumerate() {
            if let (Some(a), Some(b)) = (ends[0][i], ends[1][i]) {
                // Opposite pushes that lead to the same place, as to a tip's height, say nothing
                // about its reach.
                if (a - b).abs() > LEAST_REACH * (workspace.high - workspace.low) {
                    workspace.low = workspace.low.max(a.min(b));
                    workspace.high = workspace.high.min(a.max(b));
                }
            }
        }
        let names: &[String] = control.map_or(&[], |c| &c.reference);
        if names.is_empty() {
            // A springy plant was recorded swinging; being led somewhere is another matter.
            workspaces.iter_mut().for_each(|w| w.speed *= LED);
        }
        let (asked, reference_source) = if names.is_empty() {
            let reach: Vec<Workspace> = workspaces
                .iter()
                .zip(&outputs)
                .map(|(w, sensor)| Workspace {
                    low: home[*sensor].unwrap_or(w.low),
                    ..*w
                })
                .collect();
            (
                Reference::staircase(&reach, STAIRCASE, period_s),
                "minimum-jerk moves to 20, 40 and 80 % of the reach".into(),
            )
        } else {
            let columns: Vec<Vec<f64>> = names
                .iter()
                .zip(&outputs)
                .map(|(name, sensor)| {
                    let factor = plant.sensors()[*sensor].column_factor;
                    reference.si(name, factor, "[control] reference")
                })
                .collect::<Result<_>>()?;
            let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            (
                Reference::recorded(reference.t(), &slices, period_s),
                format!("`{}` of {}", names.join("`, `"), reference.name()),
            )
        };
        long_enough(&asked, preview)?;
        let mut units = outputs.iter().map(|s| plant.sensors()[*s].unit.as_str());
        let unit = units.next();
        Ok(Self {
            judged_s: None,
            longest_lead: preview,
            one_unit: outputs.len() > 1 && units.all(|other| Some(other) == unit),
            period_s,
            horizon,
            control_horizon,
            terminal,
            tracking_weight: control
                .and_then(|c| c.tracking_weight.clone())
                .unwrap_or_else(|| vec![1.0; outputs.len()]),
            move_suppression: control.and_then(|c| c.move_suppression.clone()),
            command_weight: control.and_then(|c| c.command_weight).unwrap_or(0.0),
            input_range: limits
                .iter()
                .map(|(low, high, _)| (high - low) / 2.0)
                .collect(),
            limits,
            output_range: workspaces.iter().map(|w| (w.high - w.low) / 2.0).collect(),
            workspaces,
            noise,
            channels,
            channel_noise,
            sensed,
            calibrated: if sensed {
                calibrated(rig, plant)
            } else {
                vec![]
            },
            home,
            outputs,
            source: match names {
                [] => Source::Designed,
                _ => Source::Recorded,
            },
            reference: asked,
            reference_source,
        })
    }

    /// Asks for `path` instead: a column an output, called what the output's own is called.
    ///
    /// # Errors
    /// A column that is not there or has no valid sample, or fewer steps than the horizon.
    pub fn follow(&mut self, path: &Recording, plant: &Plant) -> Result<()> {
        let column = |sensor: &usize| -> Result<Vec<f64>> {
            let sensor = &plant.sensors()[*sensor];
            let values = path.sensor(sensor)?;
            if !values.iter().any(|v| v.is_finite()) {
                let message = format!("`{}` has no valid sample to go to", sensor.column);
                return Err(Error::file(path.path(), message)
                    .at(1, 1)
                    .expected("a number in at least one row"));
            }
            Ok(values)
        };
        let columns = self
            .outputs
            .iter()
            .map(column)
            .collect::<Result<Vec<_>>>()?;
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let asked = Reference::recorded(path.t(), &slices, self.period_s);
        long_enough(&asked, self.preview())?;
        self.reference = asked;
        self.source = Source::Path;
        self.reference_source = format!("the path of {}", path.name());
        Ok(())
    }

    /// Channels that the network sees, and the standard deviation of each one's noise.
    pub fn seen_channels(&self) -> (&[usize], &[f64]) {
        if self.sensed {
            (&[], &[])
        } else {
            (&self.channels, &self.channel_noise)
        }
    }

    /// Rows of the reference that a step sees: those of the horizon, and those behind it.
    pub fn preview(&self) -> usize {
        self.horizon + self.terminal.map_or(0, |terminal| terminal.ahead)
    }

    /// Steps that a network predicts from its own predictions while it learns, and is judged by:
    /// the horizon; with a cost-to-go, which looks further, no fewer than without one.
    pub fn rollout(&self) -> usize {
        match self.terminal {
            Some(_) => self.preview().max(HORIZON),
            None => self.horizon,
        }
    }

    /// The cost-to-go of a model with these outputs, its operating points along the reference.
    pub fn cost_to_go(&self, outputs: &[Signal]) -> Option<ValueSpec> {
        let terminal = self.terminal?;
        let shape = (terminal.rows, terminal.ahead, terminal.points);
        value::on_motions(&self.reference.rows, outputs, shape)
    }

    /// Units of the outputs.
    pub fn units<'a>(&'a self, plant: &'a Plant) -> impl Iterator<Item = &'a str> {
        self.outputs
            .iter()
            .map(|sensor| plant.sensors()[*sensor].unit.as_str())
    }
}

/// Parameters of sensors, and of what they read of a material.
fn calibrated(rig: &Rig, plant: &Plant) -> Vec<String> {
    let sensors = rig.sensors.iter().map(|s| s.name.as_str());
    let fibres = rig.geometry.waveguides.iter().map(|w| w.name.as_str());
    let magnets = rig.geometry.magnets.iter().map(|m| m.name.as_str());
    let meters = rig.geometry.magnetometers.iter().map(|m| m.name.as_str());
    let names: Vec<&str> = sensors.chain(fibres).chain(magnets).chain(meters).collect();
    let of_a_sensor = |name: &&String| {
        let component = name.split('.').next();
        component.is_some_and(|component| names.contains(&component))
    };
    let all = plant.parameters().iter().map(|parameter| &parameter.name);
    all.filter(of_a_sensor).cloned().collect()
}

fn long_enough(asked: &Reference, preview: usize) -> Result<()> {
    if asked.steps() >= preview {
        return Ok(());
    }
    Err(Error::failed(format!(
        "the reference has {} steps, and a control step looks {preview} ahead",
        asked.steps()
    )))
}

/// The cost-to-go that is asked for, what is left open filled in. As many rows as decision
/// variables are exact for the linearised model; the rows of the reference are those that a frame
/// carries.
fn terminal(asked: TerminalTable, horizon: usize, decisions: usize, outputs: usize) -> Terminal {
    let most = (MAX_PREVIEW / outputs).saturating_sub(horizon);
    Terminal {
        rows: asked.rows.unwrap_or(decisions.min(MAX_VALUE_ROWS)),
        ahead: asked.ahead.unwrap_or(AHEAD.min(most)),
        points: asked.points.unwrap_or(POINTS),
    }
}

/// Refuses, before anything is trained, a network whose cost-to-go is not computed.
fn computable(rig: &Rig) -> Result<()> {
    let Some(table) = rig_file::network_table(rig)? else {
        return Ok(());
    };
    let reason = if table.form == Some(Form::State) {
        "`form = \"state\"`"
    } else if !table.channels.is_empty() {
        "`channels`"
    } else if matches!(table.first_layer, Some(FirstLayer::Gru | FirstLayer::Lstm)) {
        "a recurrent `first_layer`"
    } else {
        return Ok(());
    };
    let message = format!(
        "[network] has {reason}, and `terminal = \"value\"` of [control] is not computed for it"
    );
    Err(Error::file(&rig.file, message).at(table.line, 1).expected(
        "a network on past readings, as it is without `form`, `channels` and `first_layer`; \
             or no `terminal`",
    ))
}

/// Rest of each output under constant inputs; `None` where it does not rest, such as an axis that
/// drifts, and where it does not leave home. What was recorded may lie beyond: a springy plant
/// swings further than it can be held.
fn rest(
    plant: &Plant,
    home: &[Option<f64>],
    outputs: &[usize],
    limits: &[InputLimits],
    push: impl Fn(&InputLimits) -> f64,
) -> Result<Vec<Option<f64>>> {
    let start = plant.initial_state(&plant.values(), home)?;
    let inputs: Vec<f64> = limits.iter().map(push).collect();
    if !inputs.iter().all(|u| u.is_finite()) {
        return Ok(vec![None; outputs.len()]);
    }
    let seen = match balanced(plant, &inputs, &start, outputs) {
        Some(rests) => Some(rests.into_iter().map(|y| (y, y)).collect()),
        None => simulated(plant, &inputs, &start, outputs)?,
    };
    let Some(seen) = seen else {
        return Ok(vec![None; outputs.len()]);
    };
    let settled = seen.iter().zip(outputs).map(|((low, high), sensor)| {
        let travel = ((low + high) / 2.0 - home[*sensor].unwrap_or(0.0)).abs();
        (high - low < 0.02 * travel).then_some((low + high) / 2.0)
    });
    Ok(settled.collect())
}

/// Rest of each output by the balance of forces. `None` where there is none, and where friction,
/// hysteresis or play leave an interval of rests: the end of a motion then depends on its course.
fn balanced(plant: &Plant, inputs: &[f64], start: &[f64], outputs: &[usize]) -> Option<Vec<f64>> {
    let values = plant.values();
    let rest = plant.rest(&values, inputs, start).ok()?;
    let intervals = plant.rest_intervals(&values, inputs, &rest.state).ok()?;
    let rests = outputs.iter().map(|sensor| rest.signals[*sensor]);
    intervals.is_empty().then(|| rests.collect())
}

/// Lowest and highest reading of each output at the end of a long simulation; `None` where the
/// simulation fails.
fn simulated(
    plant: &Plant,
    inputs: &[f64],
    start: &[f64],
    outputs: &[usize],
) -> Result<Option<Vec<(f64, f64)>>> {
    const ROWS: usize = 600;
    let mut stepper = Stepper::new(plant, &plant.values(), start)?;
    let mut seen = vec![(f64::INFINITY, f64::NEG_INFINITY); outputs.len()];
    for row in 0..ROWS {
        if stepper.advance(SETTLING_S / ROWS as f64, inputs).is_err() {
            return Ok(None);
        }
        if row >= ROWS * 9 / 10 {
            for (seen, sensor) in seen.iter_mut().zip(outputs) {
                let y = stepper.signal(*sensor);
                *seen = (seen.0.min(y), seen.1.max(y));
            }
        }
    }
    Ok(Some(seen))
}

/// Refuses, before anything is trained, what no firmware could carry.
fn carried(
    rig: &Rig,
    period_s: f64,
    (steps, with_terminal): (usize, bool),
    outputs: usize,
) -> Result<()> {
    let refuse = |message: String, expected: &str| {
        let line = ControlTable::read(rig)?.map_or(1, |control| control.line);
        Err(Error::file(&rig.file, message)
            .at(line, 1)
            .expected(expected))
    };
    if !(1e-5..=1000.0).contains(&period_s) {
        return refuse(
            format!("[control] asks for {} steps a second", 1.0 / period_s),
            "`rate_hz` from 0.001 to 100000",
        );
    }
    let preview = steps * outputs;
    if preview > MAX_PREVIEW {
        let looked = if with_terminal {
            "`horizon` and `value_ahead` together,"
        } else {
            "`horizon`"
        };
        return refuse(
            format!("[control] asks for a reference preview of {preview} values"),
            &format!("{looked} times the number of outputs at most {MAX_PREVIEW}"),
        );
    }
    Ok(())
}

fn position_sensors(plant: &Plant) -> Vec<usize> {
    let sensors = plant.sensors().iter().enumerate();
    sensors
        .filter(|(_, s)| s.position_of.is_some())
        .map(|(i, _)| i)
        .collect()
}

/// The rig's limits; an input without one may go a fifth beyond what was recorded.
fn limits(plant: &Plant, recordings: &[Recording], period: f64) -> Result<Vec<InputLimits>> {
    let of = |input: &sinew_sim::Input| -> Result<InputLimits> {
        let (low, high) = match input.limit {
            Some(limit) => limit,
            None => {
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for recording in recordings {
                    for value in recording.input(input)?.values {
                        low = low.min(value);
                        high = high.max(value);
                    }
                }
                let margin = 0.1 * (high - low);
                (low - margin, high + margin)
            }
        };
        if high.partial_cmp(&low) != Some(std::cmp::Ordering::Greater) {
            return Err(Error::failed(format!(
                "`{}` has no limit and never moves in the recordings",
                input.column
            ))
            .help(format!("give the actuator `{}` a `limit`", input.actuator)));
        }
        Ok((
            low,
            high,
            input.rate_limit.map_or(f64::INFINITY, |rate| rate * period),
        ))
    };
    plant.inputs().iter().map(of).collect()
}

/// Root mean square speed over stretches of a hundredth of the recording, so that noise averages
/// out.
fn typical_speed(t: &[f64], y: &[f64]) -> f64 {
    let stride = (t.len() / 100).max(1);
    let speeds: Vec<f64> = (stride..t.len())
        .step_by(stride)
        .map(|i| (y[i] - y[i - stride]) / (t[i] - t[i - stride]))
        .filter(|v| v.is_finite())
        .collect();
    (speeds.iter().map(|v| v * v).sum::<f64>() / speeds.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::time::Instant;

    use super::*;

    /// Rigs without anything that ends a motion: their simulation never comes to rest.
    const UNDAMPED: &[&str] = &["torque-limited-pendulum.toml"];

    fn shipped() -> Vec<(String, Plant)> {
        let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs"));
        let files = ["", "recorded"].map(|folder| std::fs::read_dir(root.join(folder)));
        let files = files.into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = files.flatten().map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
        files.sort();
        let read = |path: PathBuf| {
            let name = path.file_name().map(|name| name.to_string_lossy().into());
            let rig = Rig::load(&path).unwrap_or_else(|error| panic!("{error}"));
            (name.unwrap_or_default(), Plant::new(&rig).expect("a plant"))
        };
        files.into_iter().map(read).collect()
    }

    /// The end of a minute's simulation and the balance of forces are one place.
    #[test]
    fn rests_by_statics_are_those_of_a_long_simulation() {
        let mut judged = 0;
        for (name, plant) in shipped() {
            if UNDAMPED.contains(&name.as_str()) || plant.only_recordings().is_some() {
                continue;
            }
            let outputs: Vec<usize> = (0..plant.sensors().len()).collect();
            let start = vec![0.0; plant.state_len()];
            for share in [0.7, -0.7] {
                let limits = plant.inputs().iter().map(|input| input.limit);
                let inputs = limits.map(|limit| match limit {
                    Some((low, high)) => REACH * if share > 0.0 { high } else { low },
                    None => share,
                });
                let inputs: Vec<f64> = inputs.collect();
                let begun = Instant::now();
                let Some(rests) = balanced(&plant, &inputs, &start, &outputs) else {
                    continue;
                };
                let by_statics = begun.elapsed().as_secs_f64();
                let begun = Instant::now();
                let seen = simulated(&plant, &inputs, &start, &outputs).expect("a start");
                let by_simulation = begun.elapsed().as_secs_f64();
                let Some(seen) = seen else {
                    panic!("{name} cannot be simulated");
                };
                let mut worst = 0.0f64;
                for (rest, (low, high)) in rests.iter().zip(seen) {
                    // The minute ends before the slowest of them are still.
                    let error = ((rest - (low + high) / 2.0).abs() - (high - low)).max(0.0);
                    worst = worst.max(error / (1e-3 + rest.abs()));
                }
                println!("{name} {share}: {worst:.1e}, {by_statics:.1e} s, {by_simulation:.1e} s");
                assert!(worst < 1e-9, "{name}: {worst:e}");
                judged += 1;
            }
        }
        assert!(judged >= 6, "{judged} rests");
    }
}
