//! `sinew simulate`: a rig driven by a recording's inputs.

use std::path::PathBuf;

use clap::Args;
use sinew_sim::{Plant, Rig};

use crate::error::Result;
use crate::recording::{Column, Recording};

/// Arguments of `sinew simulate`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    rig: PathBuf,
    /// The recording whose input columns and times are used.
    #[arg(long, value_name = "CSV")]
    input: PathBuf,
    /// Where the signals of all sensors are written.
    #[arg(long, value_name = "CSV")]
    out: PathBuf,
    /// No remarks.
    #[arg(long)]
    quiet: bool,
}

/// Columns of a recording in SI, in the plant's order.
fn columns<'a>(
    recording: &Recording,
    wanted: impl Iterator<Item = (&'a str, &'a str, f64)>,
) -> Result<Vec<Vec<f64>>> {
    wanted
        .map(|(column, by, factor)| {
            Ok(recording
                .require(column, &format!("actuator `{by}` of the rig"))?
                .iter()
                .map(|v| v * factor)
                .collect())
        })
        .collect()
}

/// # Errors
/// A bad file, or a rig that diverges.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = Rig::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let recording = Recording::read(&arguments.input)?;
    let inputs = plant
        .inputs()
        .iter()
        .map(|i| (i.column.as_str(), i.actuator.as_str(), i.column_factor));
    let inputs = columns(&recording, inputs)?;
    // A sensor that was not recorded starts from nothing and is simulated all the same.
    let signals: Vec<Vec<f64>> = plant
        .sensors()
        .iter()
        .map(|sensor| match recording.column(&sensor.column) {
            Some(values) => values.iter().map(|v| v * sensor.column_factor).collect(),
            None => vec![f64::NAN; recording.len()],
        })
        .collect();
    let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    let signals: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
    let run = plant.simulate_recording(recording.t(), &inputs, &signals)?;

    let written = plant
        .sensors()
        .iter()
        .enumerate()
        .map(|(i, sensor)| Column {
            name: sensor.column.clone(),
            values: run
                .trajectory
                .column(i)
                .iter()
                .map(|v| v / sensor.column_factor)
                .collect(),
        });
    Recording::new(&arguments.out, recording.t().to_vec(), written.collect())?
        .write(&arguments.out)?;
    if !arguments.quiet {
        for (input, held) in plant.inputs().iter().zip(&run.held) {
            if *held > 0 {
                eprintln!(
                    "{}: {held} samples are missing and held their last value",
                    input.column
                );
            }
        }
        println!(
            "{} rows of {} signals in {}",
            recording.len(),
            plant.sensors().len(),
            arguments.out.display()
        );
    }
    Ok(())
}
