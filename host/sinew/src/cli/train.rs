//! `sinew train`: a network for a rig.

use std::path::PathBuf;

use clap::Args;
use sinew_model::store;
use sinew_sim::Plant;

use super::{Common, Recordings, recording_flags};
use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::learn::{CHECKPOINT_FILE, fits, learn, save};
use crate::pipeline::plants::Plants;
use crate::pipeline::predictor::starts;
use crate::pipeline::soft_sensor::{as_sensed, attach, sensor_line};
use crate::report::training_page;
use crate::rig_file;
use sinew_ident::cli::fit::fleet;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::read_recording;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::fit::free_runs;
use sinew_ident::report::{Provenance, quantity, shared_values};

/// Arguments of `sinew train`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// Folder of the model: model.toml and weights.safetensors.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The fleet that the plant of each episode is drawn from (sinew-fleet/1).
    #[arg(long, value_name = "TOML")]
    fleet: Option<PathBuf>,
    /// File for losses and errors as JSON (sinew-training/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: learning curves and prediction errors.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// # Errors
/// A bad file, or a training that does not converge.
pub fn run(arguments: &Arguments) -> Result<()> {
    let read = |paths: &[PathBuf]| paths.iter().map(read_recording).collect::<Result<Vec<_>>>();
    let Recordings { fit, test } = &arguments.recordings;
    let recordings = fit.iter().chain(test).chain(&arguments.fleet);
    overwrite::refuse(
        std::iter::once(("RIG", arguments.rig.as_path()))
            .chain(recordings.map(|path| ("a recording", path.as_path()))),
        [
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
            (
                "--out",
                Some(arguments.out.join(store::MODEL_FILE).as_path()),
            ),
        ],
    )?;
    let rig = rig_file::load(&arguments.rig)?;
    if let Some(line) = shared_values(&rig).filter(|_| !arguments.common.quiet) {
        println!("{line}");
    }
    let plant = Plant::new(&rig)?;
    let fleet = fleet(arguments.fleet.as_deref(), &rig)?;
    let (recordings, tests) = (
        read(&arguments.recordings.fit)?,
        read(&arguments.recordings.test)?,
    );
    let reference = tests.first().unwrap_or(&recordings[0]);
    let task = ControlProblem::new(&rig, &plant, &recordings, reference)?;
    fits(&rig, &plant, &task)?;
    let task = as_sensed(&task, &plant, &recordings)?;
    let runs = free_runs(&rig, &recordings)?;
    let sampled_states = starts(&plant, &recordings, &runs)?;
    let stage = Stage::begin("train the network", arguments.common.quiet);
    let mut learned = learn(
        &rig,
        &plant,
        Plants {
            usual: &plant.values(),
            fleet: fleet.as_ref(),
        },
        &sampled_states,
        &task,
        (arguments.common.seed, &arguments.out.join(CHECKPOINT_FILE)),
        |done, of, losses| {
            stage.share(done, of, &format!("passes, loss {:.4}", losses.validation));
        },
    )?;
    stage.end(format!("{} weights", learned.record.parameters));
    let sensor = attach(&mut learned.spec, &task, &plant, &recordings, false)?;
    save(&arguments.out, &learned.spec)?;
    let said = Said::beside([arguments.json.as_deref(), arguments.report.as_deref()]);
    for (i, unit) in task.units(&plant).enumerate() {
        said.line(format!(
            "{}: {} off after one step, {} after {}, on stretches that trained nothing",
            learned.spec.outputs[i].name,
            quantity(learned.record.one_step_rms[i], unit),
            quantity(learned.record.horizon_rms[i], unit),
            learned.record.horizon
        ));
    }
    if let Some(sensor) = &sensor {
        said.line(sensor_line(&learned.spec, sensor));
    }
    if let Some(path) = &arguments.json {
        let mut document = serde_json::to_value(&learned.record)
            .map_err(|e| Error::failed(format!("{}: {e}", path.display())))?;
        document["format"] = "sinew-training/1".into();
        sinew_files::write(path, format!("{document:#}\n"))?;
        said.wrote(path);
    }
    let next = format!(
        "sinew tune {} {}{} --out tuned.toml --model-out tuned",
        arguments.rig.display(),
        arguments.out.display(),
        recording_flags(&arguments.recordings)
    );
    if let Some(path) = &arguments.report {
        let signals: Vec<(&str, &str)> = (learned.spec.outputs.iter())
            .map(|output| output.name.as_str())
            .zip(task.units(&plant))
            .collect();
        let sensor = sensor.as_ref().map(|it| sensor_line(&learned.spec, it));
        let made = Provenance::typed().seed(arguments.common.seed);
        let of = (rig.name.as_str(), &learned.record);
        training_page(of, &signals, (sensor, &next), &made).write(path)?;
        said.wrote(path);
    }
    said.line(arguments.out.join(store::MODEL_FILE).display());
    said.line(format!("next: {next}"));
    Ok(())
}
