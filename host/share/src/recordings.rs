//! Recordings of synthetic devices under a public design of inputs.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sinew_ident::error::{Error, Result};
use sinew_ident::excite::{Options, design};
use sinew_ident::noise::gaussian;
use sinew_ident::recording::{Column, Recording};
use sinew_sim::{Plant, Rig};

use crate::region::Region;

/// Inputs and noise of the recordings: public settings.
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Design of the inputs; its seed is that of the first device, and counts up.
    pub design: Options,
    /// Standard deviation of white noise, as a fraction of each signal's range.
    pub noise: f64,
}

/// Name of the recording of a device, counted from 1.
pub fn name(device: usize, of: usize) -> String {
    let width = of.to_string().len().max(2);
    format!("device-{device:0width$}.csv")
}

/// Recordings of devices at these places, each from rest.
///
/// # Errors
/// As [`design`]; a simulation that fails, with the number of the device.
pub fn recordings(
    rig: &Rig,
    region: &Region,
    places: &[Vec<f64>],
    inputs: &Inputs,
) -> Result<Vec<Recording>> {
    let plant = Plant::new(rig)?;
    let record = |(index, place): (usize, &Vec<f64>)| -> Result<Recording> {
        let name = name(index + 1, places.len());
        let failed = |error: String| {
            Error::failed(format!("{name} cannot be simulated: {error}"))
                .help("narrow the region: --within, or bounds in the rig")
        };
        let seed = inputs.design.seed.wrapping_add(index as u64);
        let options = Options {
            seed,
            ..inputs.design
        };
        let experiment = design(&plant, &rig.file, &options)?;
        let own = rig.with_values(&region.within_bounds(&plant, place))?;
        let own = Plant::new(&own).map_err(|error| failed(error.to_string()))?;
        let driven: Vec<&[f64]> = experiment.inputs.iter().map(Vec::as_slice).collect();
        // Nothing was measured: it starts from nothing.
        let nothing = vec![f64::NAN; experiment.t.len()];
        let signals = vec![nothing.as_slice(); own.sensors().len()];
        let run = own
            .simulate_recording(&experiment.t, &driven, &signals)
            .map_err(|error| failed(error.to_string()))?;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(1 << 32);
        let mut columns = Vec::new();
        for (input, values) in own.inputs().iter().zip(&experiment.inputs) {
            let values = values.iter().map(|it| it / input.column_factor);
            columns.push(Column {
                name: input.column.clone(),
                values: values.collect(),
            });
        }
        for (k, sensor) in own.sensors().iter().enumerate() {
            let mut values = run.trajectory.column(k);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            for value in &mut values {
                *value += inputs.noise * (high - low) * gaussian(&mut random);
                *value /= sensor.column_factor;
            }
            columns.push(Column {
                name: sensor.column.clone(),
                values,
            });
        }
        Recording::new(&name, experiment.t, columns)
    };
    places.par_iter().enumerate().map(record).collect()
}
