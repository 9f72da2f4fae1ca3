//! Control problem: the rig's `[control]` table, filled in from the recordings.

mod reach;
mod recorded;
mod refusals;

use sinew_device::protocol::MAX_PREVIEW;
use sinew_model::spec::{MAX_VALUE_ROWS, Signal, ValueSpec};
use sinew_model::value;
use sinew_sim::{Plant, Rig};

use crate::closed_loop::reference::{Reference, Workspace};
use crate::closed_loop::scenario::InputLimits;
use crate::rig_file::{self, ControlTable, TerminalTable};
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;

use refusals::{carried, computable, controllable, long_enough};

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
/// Speed of a designed reference, as a fraction of the recorded speed.
const LED: f64 = 0.25;

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
    /// Most instructions of the optimisation of a step, where the rig says so.
    pub budget: Option<u32>,
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
        controllable(rig, plant, &outputs)?;
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

        let (mut workspaces, noise) = recorded::workspaces(plant, &outputs, recordings, reference)?;
        let (channels, sensed) = channels(rig, control)?;
        let channel_noise = recorded::noise(plant, &channels, recordings)?;
        let home = recorded::home(plant, reference)?;
        let limits = recorded::limits(plant, recordings, period_s)?;
        reach::narrow(&mut workspaces, plant, &home, &outputs, &limits)?;
        let names: &[String] = control.map_or(&[], |c| &c.reference);
        if names.is_empty() {
            // A springy plant was recorded swinging; being led somewhere is another matter.
            workspaces.iter_mut().for_each(|w| w.speed *= LED);
        }
        let (asked, reference_source) = if names.is_empty() {
            staircase(&workspaces, &outputs, &home, period_s)
        } else {
            recorded_reference(names, plant, &outputs, reference, period_s)?
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
            budget: control.and_then(|c| c.budget),
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

/// The channels of the model, and whether they are those of a soft sensor.
fn channels(rig: &Rig, control: Option<&ControlTable>) -> Result<(Vec<usize>, bool)> {
    let channels = rig_file::network_table(rig)?.map(|network| network.channels);
    let channels = channels.unwrap_or_default();
    let Some(control) = control.filter(|control| !control.sensed_by.is_empty()) else {
        return Ok((channels, false));
    };
    if !channels.is_empty() {
        let message = "`channels` of [network] beside `sensed_by` of [control]: a soft sensor \
                       takes the channels, and the network sees none";
        return Err(Error::file(&rig.file, message)
            .at(control.line, 1)
            .expected("one of the two"));
    }
    Ok((control.sensed_by.clone(), true))
}

/// The designed reference, and where it comes from.
fn staircase(
    workspaces: &[Workspace],
    outputs: &[usize],
    home: &[Option<f64>],
    period_s: f64,
) -> (Reference, String) {
    let reach: Vec<Workspace> = workspaces
        .iter()
        .zip(outputs)
        .map(|(w, sensor)| Workspace {
            low: home[*sensor].unwrap_or(w.low),
            ..*w
        })
        .collect();
    (
        Reference::staircase(&reach, STAIRCASE, period_s),
        "minimum-jerk moves to 20, 40 and 80 % of the reach".into(),
    )
}

/// The reference in these columns of a recording, and where it comes from.
fn recorded_reference(
    names: &[String],
    plant: &Plant,
    outputs: &[usize],
    recording: &Recording,
    period_s: f64,
) -> Result<(Reference, String)> {
    let columns: Vec<Vec<f64>> = names
        .iter()
        .zip(outputs)
        .map(|(name, sensor)| {
            let factor = plant.sensors()[*sensor].column_factor;
            recording.si(name, factor, "[control] reference")
        })
        .collect::<Result<_>>()?;
    let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    Ok((
        Reference::recorded(recording.t(), &slices, period_s),
        format!("`{}` of {}", names.join("`, `"), recording.name()),
    ))
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

fn position_sensors(plant: &Plant) -> Vec<usize> {
    let sensors = plant.sensors().iter().enumerate();
    sensors
        .filter(|(_, s)| s.position_of.is_some())
        .map(|(i, _)| i)
        .collect()
}
