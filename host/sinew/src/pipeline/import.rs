//! A network of another tool as the predictor of a rig's controller.

use std::path::Path;

use sinew_model::from_network;
use sinew_model::spec::{ControlSpec, ModelSpec, OutputForm, Signal};
use sinew_nn::Network;
use sinew_sim::{Input, Plant, Rig, SensorChannel};
use sinew_train::{Form, NetworkTable};

use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::learn::{crate_name, options, score};
use crate::pipeline::learned::{control, unit_of};
use crate::rig_file;
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;
use sinew_train::train::{Scaled, Shape, Windows};

/// A recording whose rate is this close to the controller's has a sample a step.
const SAME_RATE: f64 = 0.01;

/// A model around a network that takes the regressor u(k) .., y(k) .., channels and gives y(k + 1)
/// or its change, as `form` in the rig's `[network]` says, all in the units of the recordings'
/// columns. Its settings are provisional, as those of a trained model.
///
/// # Errors
/// No `form`, a network of another shape, or with a layer that the controller has not; a signal
/// that never moves.
pub fn adopt(
    rig: &Rig,
    plant: &Plant,
    task: &ControlProblem,
    recordings: &[Recording],
    (network, from): (&Network, &Path),
) -> Result<ModelSpec> {
    let shape = shape(rig, plant, task)?;
    let table = rig_file::network_table(rig)?;
    let line = table.as_ref().map_or(1, |table| table.line);
    let form = output_form(rig, table.as_ref())?;
    let inputs: Vec<(Signal, f64)> = plant
        .inputs()
        .iter()
        .zip(&task.limits)
        .map(|(input, (low, high, _))| {
            let unit = unit_of(input.unit());
            let signal = signal(&input.column, unit, (*low, *high));
            (signal, input.column_factor)
        })
        .collect();
    let sensors = |indices: &[usize]| -> Result<Vec<(Signal, f64)>> {
        let of = |sensor: &usize| {
            let sensor = &plant.sensors()[*sensor];
            let range = range(recordings, sensor)?;
            let signal = signal(&sensor.column, &sensor.unit, range);
            Ok((signal, sensor.column_factor))
        };
        indices.iter().map(of).collect()
    };
    let (outputs, channels) = (sensors(&task.outputs)?, sensors(task.seen_channels().0)?);
    // In the units of the columns, which is what the network was trained on.
    let scales = |signals: &[(Signal, f64)]| -> Vec<(f64, f64)> {
        let each = signals.iter();
        each.map(|(s, factor)| (s.span / factor, s.offset / factor))
            .collect()
    };
    let mut regressor = scales(&inputs).repeat(shape.past_inputs);
    regressor.extend(scales(&outputs).repeat(shape.past_outputs));
    regressor.extend(scales(&channels));
    let mut given = scales(&outputs);
    if form == OutputForm::Increment {
        given.iter_mut().for_each(|(_, offset)| *offset = 0.0);
    }
    if (network.inputs(), network.outputs()) != (regressor.len(), given.len()) {
        let wanted = (regressor.len(), given.len());
        return Err(other_shape(rig, line, (network, from), &shape, wanted));
    }
    let layers = from_network::layers(network, &regressor, &given)
        .map_err(|e| Error::file(from, e.to_string()))?;
    let bare = |signals: Vec<(Signal, f64)>| signals.into_iter().map(|(s, _)| s).collect();
    let mut spec = ModelSpec {
        name: crate_name(&rig.name),
        period_s: task.period_s,
        inputs: bare(inputs),
        outputs: bare(outputs),
        channels: bare(channels),
        past_inputs: shape.past_inputs,
        past_outputs: shape.past_outputs,
        form,
        skip: None,
        layers,
        control: ControlSpec {
            observer_gain: table
                .as_ref()
                .and_then(|table| table.observer_gain)
                .unwrap_or(1.0),
            ..control(task)
        },
        state: None,
        soft_sensor: None,
        golden: vec![],
    };
    spec.control.value = task.cost_to_go(&spec.outputs);
    spec.validate()
        .map_err(|e| Error::file(from, e.to_string()))?;
    Ok(spec)
}

/// Root mean square errors on recordings, SI, one step ahead and at the horizon, the sensors' noise
/// in them; none for recordings that are sampled at another rate than the controller's, have gaps,
/// or are too short for one horizon.
pub fn judged(
    rig: &Rig,
    plant: &Plant,
    task: &ControlProblem,
    spec: &ModelSpec,
    recordings: &[Recording],
) -> Option<(Vec<f64>, Vec<f64>)> {
    let episodes: Option<Vec<Scaled>> = recordings
        .iter()
        .map(|recording| episode(plant, task, spec, recording))
        .collect();
    let scaling: Vec<(f64, f64)> = spec.outputs.iter().map(|s| (s.span, s.offset)).collect();
    let (shape, episodes) = (shape(rig, plant, task).ok()?, episodes?);
    if Windows::new(shape, 0, task.rollout(), &episodes).is_empty() {
        return None;
    }
    Some(score(spec, shape, 0, task, &episodes, &scaling))
}

/// Form that the rig's `[network]` says.
fn output_form(rig: &Rig, table: Option<&NetworkTable>) -> Result<OutputForm> {
    let line = table.map_or(1, |table| table.line);
    match table.and_then(|t| t.form) {
        Some(Form::State) => Err(Error::file(
            &rig.file,
            "`form = \"state\"` of [network] is for networks that `sinew train` makes",
        )
        .expected("`form = \"absolute\"` or `form = \"increment\"`")),
        Some(Form::Absolute) => Ok(OutputForm::Absolute),
        Some(Form::Increment) => Ok(OutputForm::Increment),
        None => Err(
            Error::file(&rig.file, "[network] does not say what the network gives")
                .at(line, 1)
                .expected(
                    "`form = \"absolute\"`, the next output, or `form = \"increment\"`, its change",
                ),
        ),
    }
}

/// Refusal of a network that takes and gives other counts of numbers than `expected`.
fn other_shape(
    rig: &Rig,
    line: usize,
    (network, from): (&Network, &Path),
    shape: &Shape,
    expected: (usize, usize),
) -> Error {
    let (takes, gives) = (network.inputs(), network.outputs());
    let message = format!(
        "{}: the network takes {takes} numbers and gives {gives}, which is not what [network] says",
        from.display()
    );
    Error::file(&rig.file, message)
            .at(line, 1)
            .expected(format!(
                "{} numbers in: {} inputs, {} values each, {} outputs, {} values each, {} channels; and {} out",
                expected.0,
                shape.n_u,
                shape.past_inputs,
                shape.n_y,
                shape.past_outputs,
                shape.n_s,
                expected.1
            ))
            .help("`past_inputs`, `past_outputs` and `channels` say what it is given")
}

fn shape(rig: &Rig, plant: &Plant, task: &ControlProblem) -> Result<Shape> {
    Ok(Shape {
        n_u: plant.inputs().len(),
        n_y: task.outputs.len(),
        ..options(rig, task.rollout(), 0)?.0
    })
}

fn signal(column: &str, unit: &str, (low, high): (f64, f64)) -> Signal {
    Signal {
        name: column.into(),
        unit: unit.into(),
        span: (high - low) / 2.0,
        offset: (high + low) / 2.0,
    }
}

/// Lowest and highest reading of a sensor, SI.
fn range(recordings: &[Recording], sensor: &SensorChannel) -> Result<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for recording in recordings {
        for value in recording.sensor(sensor)? {
            low = low.min(value);
            high = high.max(value);
        }
    }
    if low < high {
        return Ok((low, high));
    }
    let column = &sensor.column;
    let message = format!("`{column}` never moves, so its range is not known");
    let first = recordings.first().map_or(Path::new(""), Recording::path);
    Err(Error::file(first, message)
        .at(1, 1)
        .expected("a recording in which every output and channel moves"))
}

fn episode(
    plant: &Plant,
    task: &ControlProblem,
    spec: &ModelSpec,
    recording: &Recording,
) -> Option<Scaled> {
    let t = recording.t();
    let even = |pair: &[f64]| ((pair[1] - pair[0]) / task.period_s - 1.0).abs() < SAME_RATE;
    if t.len() < 2 || !t.windows(2).all(even) {
        return None;
    }
    let rows = |columns: Vec<Vec<f64>>, signals: &[Signal], count: usize| -> Option<Vec<f64>> {
        let scaled = |k: usize| {
            let row = columns.iter().zip(signals);
            row.map(move |(column, s)| (column[k] - s.offset) / s.span)
        };
        let rows: Vec<f64> = (0..count).flat_map(scaled).collect();
        rows.iter().all(|v| v.is_finite()).then_some(rows)
    };
    let sensors = |indices: &[usize]| -> Option<Vec<Vec<f64>>> {
        let each = indices.iter().map(|sensor| &plant.sensors()[*sensor]);
        each.map(|sensor| recording.sensor(sensor).ok()).collect()
    };
    let input = |input: &Input| {
        let found = recording.si(&input.column, input.column_factor, &input.wanted_by());
        found.ok()
    };
    let inputs: Option<Vec<Vec<f64>>> = plant.inputs().iter().map(input).collect();
    let steps = t.len() - 1;
    let y = rows(sensors(&task.outputs)?, &spec.outputs, t.len())?;
    Some(Scaled {
        u: rows(inputs?, &spec.inputs, steps)?,
        measured: y.clone(),
        y,
        channels: rows(sensors(task.seen_channels().0)?, &spec.channels, t.len())?,
        sensitivities: vec![],
        steps,
    })
}
