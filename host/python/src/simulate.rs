//! Simulation and experiments.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sinew_ident::error::{Error, Result};
use sinew_ident::excite::{Kind, Options, design};

use crate::data::{RawColumn, RawRecording, bytes, recordings, refused};
use crate::rig::NativeRig;
use crate::work;

/// Drives a rig with the inputs of a recording: a column a sensor, in the unit of the column.
#[pyfunction]
pub fn simulate(
    py: Python<'_>,
    rig: &NativeRig,
    recording: RawRecording,
) -> PyResult<Vec<RawColumn>> {
    let plant = rig.plant()?;
    let recording = recordings(vec![recording])?.remove(0);
    work::run(
        py,
        None,
        || {},
        |_| -> Result<_> {
            let mut inputs = Vec::new();
            for input in plant.inputs() {
                let values = recording.require(&input.column, &input.wanted_by())?;
                if !values.iter().any(|value| value.is_finite()) {
                    let message = format!(
                        "input column `{}` has no valid sample to hold",
                        input.column
                    );
                    return Err(Error::file(recording.path(), message)
                        .expected("a number in at least one row"));
                }
                inputs.push(
                    values
                        .iter()
                        .map(|v| v * input.column_factor)
                        .collect::<Vec<_>>(),
                );
            }
            let missing = vec![f64::NAN; recording.len()];
            let of_sensor = |sensor: &sinew_sim::SensorChannel| {
                let values = recording.column(&sensor.column).unwrap_or(&missing);
                values
                    .iter()
                    .map(|v| v * sensor.column_factor)
                    .collect::<Vec<_>>()
            };
            let signals: Vec<Vec<f64>> = plant.sensors().iter().map(of_sensor).collect();
            let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
            let signals: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
            let run = plant.simulate_recording(recording.t(), &inputs, &signals)?;
            let sensors = plant.sensors().iter().enumerate();
            let columns = sensors.map(|(k, sensor)| {
                let values = run.trajectory.column(k);
                let values: Vec<f64> = values.iter().map(|v| v / sensor.column_factor).collect();
                (sensor.column.clone(), bytes(&values))
            });
            Ok(columns.collect())
        },
    )
}

/// Designs an experiment: times and input columns, in the units of the columns.
#[pyfunction]
pub fn excite(
    rig: &NativeRig,
    kind: &str,
    seconds: f64,
    rate: f64,
    seed: u64,
    amplitude: f64,
    band: Option<[f64; 2]>,
) -> PyResult<(Vec<u8>, Vec<RawColumn>)> {
    let kind = match kind {
        "multisine" => Kind::Multisine,
        "steps" => Kind::Steps,
        "triangle" => Kind::Triangle,
        "chirp" => Kind::Chirp,
        "mixed" => Kind::Mixed,
        other => {
            let known = "multisine, steps, triangle, chirp or mixed";
            return Err(PyValueError::new_err(format!(
                "kind must be {known}; got {other}"
            )));
        }
    };
    let options = Options {
        kind,
        seconds,
        rate_hz: rate,
        seed,
        amplitude,
        band_hz: band,
    };
    let plant = rig.plant()?;
    let experiment = design(&plant, &rig.file, &options).map_err(refused)?;
    let columns = plant.inputs().iter().zip(&experiment.inputs);
    let columns = columns.map(|(input, values)| {
        let values: Vec<f64> = values.iter().map(|u| u / input.column_factor).collect();
        (input.column.clone(), bytes(&values))
    });
    Ok((bytes(&experiment.t), columns.collect()))
}
