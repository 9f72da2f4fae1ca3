//! Soft sensor of a model: calibrated on recordings that have both the channels and the outputs.

use std::path::Path;

use sinew_ident::error::{Error, Result};
use sinew_ident::recording::{Column, Recording};
use sinew_ident::report::{count, quantity};
use sinew_model::spec::{ModelSpec, Signal};
use sinew_sim::Plant;
use sinew_train::soft_sensor::{Calibrated, calibrate};

use super::learned::unit_of;
use crate::closed_loop::control_problem::ControlProblem;

/// The task as a training sees it: behind a soft sensor an output is as noisy as what the sensor
/// says. Other tasks come back as they are.
///
/// # Errors
/// As [`attach`]; said before anything is trained.
pub fn as_sensed(
    task: &ControlProblem,
    plant: &Plant,
    recordings: &[Recording],
) -> Result<ControlProblem> {
    let mut task = task.clone();
    if task.sensed {
        let scaling: Vec<(f64, f64)> = task.output_range.iter().map(|span| (*span, 0.0)).collect();
        task.noise = of(&task, plant, recordings, &scaling)?.spec.error;
    }
    Ok(task)
}

/// Calibrates the soft sensor of `spec` where the task has one; its channels watch one another if
/// `watched`. Gives the rows that did, and the ridge.
///
/// # Errors
/// Recordings that lack a column, or that do not determine the map.
pub fn attach(
    spec: &mut ModelSpec,
    task: &ControlProblem,
    plant: &Plant,
    recordings: &[Recording],
    watched: bool,
) -> Result<Option<Calibrated>> {
    if !task.sensed {
        return Ok(None);
    }
    let scaling: Vec<(f64, f64)> = spec.outputs.iter().map(|s| (s.span, s.offset)).collect();
    let mut found = of(task, plant, recordings, &scaling)?;
    if !watched {
        found.spec.watch = None;
    }
    let sensors = task.channels.iter().map(|s| &plant.sensors()[*s]);
    let channels = sensors
        .zip(&found.channels)
        .map(|(sensor, (span, offset))| Signal {
            name: sensor.column.clone(),
            unit: unit_of(&sensor.unit).into(),
            span: *span,
            offset: *offset,
        });
    spec.channels = channels.collect();
    spec.soft_sensor = Some(found.spec.clone());
    spec.validate()
        .map_err(|e| Error::failed(format!("the soft sensor: {e}")))?;
    Ok(Some(found))
}

/// One line for a person: how far the map is off.
pub fn sensor_line(spec: &ModelSpec, found: &Calibrated) -> String {
    let each = spec.outputs.iter().zip(&found.spec.error);
    let errors: Vec<String> = each
        .map(|(signal, error)| format!("{} {}", signal.name, quantity(*error, &signal.unit)))
        .collect();
    let watch = match &found.spec.watch {
        None => String::new(),
        Some(watch) => {
            let each = || watch.spread.iter().map(|spread| 50.0 * spread);
            format!(
                "\nchannels watched: the others say each to {:.1} to {:.1} % of its range",
                each().fold(f32::INFINITY, f32::min),
                each().fold(0.0, f32::max)
            )
        }
    };
    format!(
        "soft sensor of {}: off by {} (RMS, on stretches of {} rows that did not calibrate it){watch}",
        count(spec.channels.len(), "channel"),
        errors.join(", "),
        found.rows
    )
}

fn of(
    task: &ControlProblem,
    plant: &Plant,
    recordings: &[Recording],
    scaling: &[(f64, f64)],
) -> Result<Calibrated> {
    let read = |sensors: &[usize]| -> Result<Vec<Column>> {
        let one = |sensor: &usize| -> Result<Column> {
            let sensor = &plant.sensors()[*sensor];
            let parts = recordings.iter().map(|r| r.sensor(sensor));
            Ok(Column {
                name: sensor.column.clone(),
                values: parts.collect::<Result<Vec<_>>>()?.concat(),
            })
        };
        sensors.iter().map(one).collect()
    };
    // Several recordings are one calibration; the first stands for them.
    let file = recordings.first().map_or(Path::new(""), Recording::path);
    calibrate(&read(&task.channels)?, &read(&task.outputs)?, scaling, file)
}
