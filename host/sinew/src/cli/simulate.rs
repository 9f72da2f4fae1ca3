//! `sinew simulate`: a rig driven by a recording's inputs.

use std::path::PathBuf;

use clap::Args;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value, json};
use sinew_sim::{Input, InputTrajectory, MotionQuantity, Plant, RecordingRun, Rig};

use super::result;
use crate::closed_loop::plant_program::{PlantProgram, Recorded};
use crate::rig_file;
use crate::view::{self, Animation};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::repair::read_recording;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::fit::{FreeRun, FreeRunSensor, pool};
use sinew_ident::noise::gaussian;
use sinew_ident::recording::{Column, Recording};
use sinew_ident::report::{Block, Provenance, Report, Section, Tone, quantity};
use sinew_ident::validation::{Free, Model, chapters, motions};

/// Arguments of `sinew simulate`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    rig: PathBuf,
    /// The recording whose input columns and times are used.
    #[arg(long, value_name = "CSV")]
    input: PathBuf,
    /// File for the signals of all sensors.
    #[arg(long, value_name = "CSV")]
    out: PathBuf,
    /// Write the input columns as well, so that the file is a recording to fit to.
    #[arg(long)]
    with_inputs: bool,
    /// Standard deviation of white noise, as a fraction of each signal's range.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    noise: f64,
    /// A program that is the plant instead, as a line for `sh`.
    ///
    /// Only signals that it has are written.
    #[arg(long, value_name = "COMMAND", conflicts_with_all = ["plot", "report"])]
    plant_program: Option<String>,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw signals and inputs over time.
    #[arg(long, value_name = "SVG")]
    plot: Option<PathBuf>,
    /// File for a page: plots, what was measured over what was simulated, and the rig's shape.
    #[arg(long, value_name = "HTML", alias = "html")]
    report: Option<PathBuf>,
    /// File for what was simulated as JSON (sinew-simulation/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// Columns of a recording in SI, in the plant's order.
fn columns(recording: &Recording, wanted: &[Input]) -> Result<Vec<Vec<f64>>> {
    wanted
        .iter()
        .map(|input| {
            let column = &input.column;
            let values = recording.si(column, input.column_factor, &input.wanted_by())?;
            if !values.iter().any(|value| value.is_finite()) {
                let message = format!("input column `{column}` has no valid sample to hold");
                return Err(Error::file(recording.path(), message)
                    .at(1, 1)
                    .expected("a number in at least one row"));
            }
            Ok(values)
        })
        .collect()
}

/// True of an input that is a column itself, and of one of those that follow from a column.
fn is_recorded(input: &Input) -> bool {
    matches!(input.motion, None | Some(MotionQuantity::Position))
}

/// The inputs as the plant takes them: imposed motions smoothed, gaps held.
fn driven(plant: &Plant, recording: &Recording, inputs: &[Vec<f64>]) -> Result<InputTrajectory> {
    let mut columns = inputs.to_vec();
    plant
        .derive_motions(recording.t(), &mut columns)
        .map_err(|error| Error::file(recording.path(), error.to_string()))?;
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    Ok(InputTrajectory::new(plant, recording.len(), &columns)?)
}

/// White noise on a signal, its deviation a fraction of the signal's range.
fn disturb(signal: &mut [f64], fraction: f64, random: &mut ChaCha8Rng) {
    let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
    let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for value in signal {
        *value += fraction * (high - low) * gaussian(random);
    }
}

/// # Errors
/// A bad file, or a rig that diverges.
pub fn run(arguments: &Arguments) -> Result<()> {
    if !(0.0..=1.0).contains(&arguments.noise) {
        let expectation = "a fraction of a signal's range in [0, 1]";
        return Err(Error::must_be("--noise", expectation, arguments.noise)
            .help("for example --noise 0.005: half a percent"));
    }
    overwrite::refuse(
        [
            ("the rig", arguments.rig.as_path()),
            ("--input", arguments.input.as_path()),
        ],
        [
            ("--out", Some(arguments.out.as_path())),
            ("--plot", arguments.plot.as_deref()),
            ("--report", arguments.report.as_deref()),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let rig = rig_file::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let recording = read_recording(&arguments.input, arguments.quiet)?;
    let inputs = columns(&recording, plant.inputs())?;
    let drive = driven(&plant, &recording, &inputs)?;
    let said = Said::beside(
        [
            Some(arguments.out.as_path()),
            arguments.plot.as_deref(),
            arguments.report.as_deref(),
            arguments.json.as_deref(),
        ],
        arguments.quiet,
    );
    let signals = match &arguments.plant_program {
        Some(command) => {
            let program = PlantProgram {
                command: command.clone(),
                draw: 0,
                spread: 0.0,
            };
            let recorded = program.record(&plant, recording.t(), &drive)?;
            remark(said, &plant, &recorded);
            recorded.signals
        }
        None => simulated(arguments, &rig, &plant, &recording, &inputs)?,
    };

    let mut random = ChaCha8Rng::seed_from_u64(arguments.seed);
    let mut written = Vec::new();
    for (input, held) in plant
        .inputs()
        .iter()
        .zip(&inputs)
        .filter(|(input, _)| arguments.with_inputs && is_recorded(input))
    {
        written.push(Column {
            name: input.column.clone(),
            values: held.iter().map(|v| v / input.column_factor).collect(),
        });
    }
    let mut signals_written = 0;
    let mut shown = Vec::new();
    let mut not_written = Vec::new();
    for (sensor, values) in plant.sensors().iter().zip(signals) {
        let Some(mut values) = values else {
            not_written.push(sensor.column.as_str());
            continue;
        };
        signals_written += 1;
        if arguments.noise > 0.0 {
            disturb(&mut values, arguments.noise, &mut random);
        }
        values.iter_mut().for_each(|v| *v /= sensor.column_factor);
        shown.push(range(&sensor.column, &sensor.unit, &values));
        written.push(Column {
            name: sensor.column.clone(),
            values,
        });
    }
    Recording::new(&arguments.out, recording.t().to_vec(), written)?.write(&arguments.out)?;
    for (input, held) in plant.inputs().iter().zip(drive.held()) {
        if *held > 0 {
            said.warning(format!(
                "{}: {held} samples are missing and held their last value",
                input.column
            ));
        }
    }
    said.line(format!(
        "{} rows of {} signals in {}",
        recording.len(),
        signals_written,
        arguments.out.display()
    ));
    let others = [&arguments.plot, &arguments.report, &arguments.json];
    for path in others.into_iter().flatten() {
        said.wrote(path);
    }
    let fit = if arguments.with_inputs {
        &arguments.out
    } else {
        &arguments.input
    };
    said.next(format!(
        "sinew fit {} --fit {} --out fitted.toml",
        arguments.rig.display(),
        fit.display()
    ));
    let held = plant.inputs().iter().zip(drive.held());
    let held = held.filter(|(input, _)| is_recorded(input));
    let held: Map<String, Value> = held
        .map(|(input, held)| (input.column.clone(), json!(held)))
        .collect();
    let t = recording.t();
    result::write(arguments.json.as_deref(), || {
        json!({
            "format": "sinew-simulation/1",
            "rig": rig.name,
            "rows": recording.len(),
            "duration_s": t.last().zip(t.first()).map_or(0.0, |(last, first)| last - first),
            "signals": shown,
            "not_written": not_written,
            "held_samples": held,
        })
    })
}

/// A signal's range, as its column is written.
fn range(column: &str, unit: &str, values: &[f64]) -> Value {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let ends = finite().fold(None, |ends: Option<[f64; 2]>, value| {
        let [low, high] = ends.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    });
    json!({ "signal": column, "unit": unit, "range": ends })
}

/// Signals of the program and of the rig that are not written.
fn remark(said: Said, plant: &Plant, recorded: &Recorded) {
    for name in &recorded.strangers {
        said.warning(format!(
            "`{name}` of the program is not written: no sensor of the rig is called so"
        ));
    }
    for (sensor, signal) in plant.sensors().iter().zip(&recorded.signals) {
        if signal.is_none() {
            said.warning(format!(
                "`{}` of the rig is not written: the program has no such signal",
                sensor.column
            ));
        }
    }
}

/// Signals of every sensor, SI; plot and page are written where they were asked for.
fn simulated(
    arguments: &Arguments,
    rig: &Rig,
    plant: &Plant,
    recording: &Recording,
    inputs: &[Vec<f64>],
) -> Result<Vec<Option<Vec<f64>>>> {
    // A sensor that was not recorded starts from nothing and is simulated all the same.
    let signals: Vec<Vec<f64>> = plant
        .sensors()
        .iter()
        .map(|sensor| {
            let recorded = recording.sensor(sensor);
            recorded.unwrap_or_else(|_| vec![f64::NAN; recording.len()])
        })
        .collect();
    let driven: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    let signals: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
    let run = plant.simulate_recording(recording.t(), &driven, &signals)?;
    draw(arguments, rig, plant, recording, inputs, &run)?;
    let columns = 0..plant.sensors().len();
    Ok(columns.map(|i| Some(run.trajectory.column(i))).collect())
}

/// Writes the plot and the page, where they were asked for.
fn draw(
    arguments: &Arguments,
    rig: &Rig,
    plant: &Plant,
    recording: &Recording,
    inputs: &[Vec<f64>],
    run: &RecordingRun,
) -> Result<()> {
    let plots = || view::simulation(plant, recording.t(), inputs, &run.trajectory);
    if let Some(path) = &arguments.plot {
        sinew_files::write(path, sinew_ident::report::sheet(&plots()))?;
    }
    let Some(path) = &arguments.report else {
        return Ok(());
    };
    let mut animation = Animation::new(recording.len());
    let drive = driven(plant, recording, inputs)?;
    let values = plant.values();
    let mut looked = Ok(());
    plant.simulate_with(
        &values,
        &run.start,
        &drive,
        recording.t(),
        |row, stepper| {
            let (time, state) = (recording.t()[row], stepper.state());
            if looked.is_ok() {
                looked = animation.take(row, time, plant, &values, &state);
            }
        },
    )?;
    looked?;
    let mut lead = format!(
        "{} rows from {} s to {} s, driven by {}.",
        recording.len(),
        recording.t()[0],
        recording.t()[recording.len() - 1],
        recording.name(),
    );
    let shape = (!animation.is_empty()).then_some(&animation);
    let measured = [free_run(plant, recording, run)];
    let shown = measured[0].sensors.iter();
    let known: Vec<bool> = (shown.clone())
        .map(|sensor| sensor.measured.iter().any(|value| value.is_finite()))
        .collect();
    for error in pool(&measured) {
        if error.samples > 0 {
            lead += &format!(
                " {}: fit {}, RMS {}.",
                error.signal,
                error.fit_text(),
                quantity(error.rms, &error.unit)
            );
        }
    }
    let free = Free {
        rig,
        // The recording chose nothing of this rig.
        recordings: vec![("test", recording)],
        models: vec![Model {
            name: "simulated",
            tone: Tone::Blue,
            runs: &measured,
        }],
    };
    let mut over = Section::new("Measured over simulated");
    let plots_of = motions(&free.models, 0, "", &[]);
    for (pair, known) in plots_of.chunks(2).zip(&known) {
        if *known {
            over = (pair.iter().cloned())
                .map(Block::Plot)
                .fold(over, Section::with);
        }
    }
    let mut page = view::page(&rig.name, lead, shape, plots());
    if known.iter().any(|known| *known) {
        // First after the shape: it is what the page is looked at for.
        let at = usize::from(!animation.is_empty());
        page.sections.insert(at, over);
        page = page.next(format!(
            "sinew fit {} --fit {}",
            arguments.rig.display(),
            arguments.input.display()
        ));
    }
    if known.iter().all(|known| *known) {
        page = chapters(&free)?.into_iter().fold(page, Report::section);
    }
    let made = Provenance::typed().seed(arguments.seed);
    page.made(&made).write(path)
}

/// The simulation beside what the recording has of it.
fn free_run(plant: &Plant, recording: &Recording, run: &RecordingRun) -> FreeRun {
    let sensors = plant.sensors().iter().enumerate().map(|(i, sensor)| {
        let recorded = recording.sensor(sensor);
        FreeRunSensor {
            signal: sensor.column.clone(),
            unit: sensor.unit.clone(),
            measured: recorded.unwrap_or_else(|_| vec![f64::NAN; recording.len()]),
            simulated: run.trajectory.column(i),
        }
    });
    FreeRun {
        recording: recording.name(),
        t: recording.t().to_vec(),
        judged_from: 0,
        start: run.start.clone(),
        values: plant.values(),
        own: Vec::new(),
        sensors: sensors.collect(),
    }
}
