//! Columns between numpy and Rust.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sinew_ident::fit::FreeRun;
use sinew_ident::recording::{Column, Recording};

/// A recording as Python passes it: name, times and columns, each as bytes of doubles.
pub type RawRecording = (String, Vec<u8>, Vec<(String, Vec<u8>)>);

/// A column as Python takes it.
pub type RawColumn = (String, Vec<u8>);

/// A free run as Python takes it: recording, first row that is judged, times, and of each sensor
/// its column, its unit, what was measured and what was simulated.
pub type RawRun = (
    String,
    usize,
    Vec<u8>,
    Vec<(String, String, Vec<u8>, Vec<u8>)>,
);

/// An error of the library as `ValueError` with the same text.
pub fn refused(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Doubles from their bytes.
fn doubles(bytes: &[u8]) -> Vec<f64> {
    let (chunks, _) = bytes.as_chunks::<8>();
    chunks
        .iter()
        .map(|chunk| f64::from_le_bytes(*chunk))
        .collect()
}

/// Bytes of doubles.
pub fn bytes(values: &[f64]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Recordings of one role.
///
/// # Errors
/// As [`Recording::new`].
pub fn recordings(raw: Vec<RawRecording>) -> PyResult<Vec<Recording>> {
    let recording = |(name, t, columns): RawRecording| {
        let columns = columns.into_iter().map(|(name, values)| Column {
            name,
            values: doubles(&values),
        });
        Recording::new(name, doubles(&t), columns.collect()).map_err(refused)
    };
    raw.into_iter().map(recording).collect()
}

/// A free run for Python.
pub fn raw_run(run: &FreeRun) -> RawRun {
    let sensors = run.sensors.iter().map(|sensor| {
        let (measured, simulated) = (bytes(&sensor.measured), bytes(&sensor.simulated));
        (
            sensor.signal.clone(),
            sensor.unit.clone(),
            measured,
            simulated,
        )
    });
    (
        run.recording.clone(),
        run.judged_from,
        bytes(&run.t),
        sensors.collect(),
    )
}
