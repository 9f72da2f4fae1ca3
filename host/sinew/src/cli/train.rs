//! `sinew train`: a network for a rig.

use std::path::PathBuf;

use clap::Args;
use sinew_model::spec::ModelSpec;
use sinew_model::store;
use sinew_sim::{Plant, Rig};

use super::{Common, Recordings, recording_flags};
use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::kept_model::{self, Kept};
use crate::pipeline::learn::{CHECKPOINT_FILE, Record, fits, learn, save, went_on};
use crate::pipeline::plants::Plants;
use crate::pipeline::predictor::starts;
use crate::pipeline::soft_sensor::{as_sensed, attach, sensor_line};
use crate::report::training_page;
use crate::rig_file;
use sinew_ident::cli::fit::fleet;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::read_recordings;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::fit::free_runs;
use sinew_ident::population::Fleet;
use sinew_ident::recording::Recording;
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
    /// Train anew, though the model that is there has the same rig, recordings and seed.
    #[arg(long)]
    again: bool,
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
    let read = |paths: &[PathBuf]| read_recordings(paths, arguments.common.quiet);
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
    let said = Said::beside(
        [arguments.json.as_deref(), arguments.report.as_deref()],
        arguments.common.quiet,
    );
    let rig = rig_file::load(&arguments.rig)?;
    if let Some(line) = shared_values(&rig) {
        said.line(line);
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
    let seed = arguments.common.seed;
    let key = kept_model::key(&rig, (&recordings, &tests), seed, fleet.as_ref());
    let kept = Kept::find(&arguments.out, key).filter(|_| !arguments.again);
    let stage = Stage::begin("train the network", arguments.common.quiet);
    let (spec, record, sensor) = match kept {
        Some((kept, spec)) => {
            stage.end("as before: same rig, recordings and seed; --again trains anew");
            (spec, kept.record, kept.sensor)
        }
        None => {
            let work = Work {
                rig: &rig,
                plant: &plant,
                task: &task,
                recordings: &recordings,
                fleet: fleet.as_ref(),
            };
            let (spec, record, sensor) = work.train(arguments, stage)?;
            Kept::note(&arguments.out, key, &record, sensor.clone())?;
            (spec, record, sensor)
        }
    };
    for (i, unit) in task.units(&plant).enumerate() {
        said.line(format!(
            "{}: {} off after one step, {} after {}, on stretches that trained nothing",
            spec.outputs[i].name,
            quantity(record.one_step_rms[i], unit),
            quantity(record.horizon_rms[i], unit),
            record.horizon
        ));
    }
    if let Some(sensor) = &sensor {
        said.line(sensor);
    }
    if let Some(path) = &arguments.json {
        let mut document = serde_json::to_value(&record)
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
        let signals: Vec<(&str, &str)> = (spec.outputs.iter())
            .map(|output| output.name.as_str())
            .zip(task.units(&plant))
            .collect();
        let made = Provenance::typed().seed(arguments.common.seed);
        let of = (rig.name.as_str(), &record);
        training_page(of, &signals, (sensor, &next), &made).write(path)?;
        said.wrote(path);
    }
    said.line(arguments.out.join(store::MODEL_FILE).display());
    said.next(&next);
    Ok(())
}

/// Inputs of a training.
struct Work<'a> {
    rig: &'a Rig,
    plant: &'a Plant,
    task: &'a ControlProblem,
    recordings: &'a [Recording],
    fleet: Option<&'a Fleet>,
}

impl Work<'_> {
    /// Trains and saves the model: the model, its record, the line about its soft sensor.
    fn train(
        &self,
        arguments: &Arguments,
        stage: Stage,
    ) -> Result<(ModelSpec, Record, Option<String>)> {
        let &Self {
            rig,
            plant,
            recordings,
            ..
        } = self;
        let task = as_sensed(self.task, plant, recordings)?;
        let runs = free_runs(rig, recordings)?;
        let sampled_states = starts(plant, recordings, &runs)?;
        let mut first = None;
        let mut learned = learn(
            rig,
            plant,
            Plants {
                usual: &plant.values(),
                fleet: self.fleet,
            },
            &sampled_states,
            &task,
            (arguments.common.seed, &arguments.out.join(CHECKPOINT_FILE)),
            |done, of, losses| {
                first.get_or_insert(done);
                stage.share(done, of, &format!("passes, loss {:.4}", losses.validation));
            },
        )?;
        stage.end(format!(
            "{} weights{}",
            learned.record.parameters,
            went_on(first)
        ));
        let sensor = attach(&mut learned.spec, &task, plant, recordings, false)?;
        save(&arguments.out, &learned.spec)?;
        let sensor = sensor.map(|sensor| sensor_line(&learned.spec, &sensor));
        Ok((learned.spec, learned.record, sensor))
    }
}
