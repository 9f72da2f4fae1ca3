//! A model that is there already, put into its loop: what `compare` and `pil` share.

use std::path::{Path, PathBuf};

use sinew_codegen::fingerprint;
use sinew_codegen::spec::{ModelSpec, Signal};
use sinew_codegen::store;
use sinew_sim::{Plant, Rig};

use super::build::compile_in;
use super::side_by_side::{Bench, DeviceRun};
use super::task::Task;
use crate::compare::closed_loop::Scenario;
use crate::compare::disturbance::Disturbance;
use crate::compare::results::{Entry, Results};
use crate::error::{Error, Result};
use crate::progress::Stage;
use crate::project::{self, Board};
use crate::recording::Recording;

/// A rig, its task and its model.
pub struct Loop {
    /// The rig, compiled.
    pub plant: Plant,
    /// What the controller is asked for.
    pub task: Task,
    /// The model.
    pub spec: ModelSpec,
}

impl Loop {
    /// Reads all files and checks that they belong together.
    ///
    /// # Errors
    /// A bad file, or a model whose signals are not the rig's.
    pub fn load(rig: &Path, model: &Path, fit: &[PathBuf], test: &[PathBuf]) -> Result<Self> {
        let read = |paths: &[PathBuf]| {
            paths
                .iter()
                .map(Recording::read)
                .collect::<Result<Vec<_>>>()
        };
        let rig = Rig::load(rig)?;
        let plant = Plant::new(&rig)?;
        let (recordings, tests) = (read(fit)?, read(test)?);
        let reference = tests
            .first()
            .or(recordings.last())
            .ok_or_else(|| Error::arguments("no recording").help("name one with --fit"))?;
        let task = Task::new(&rig, &plant, &recordings, reference)?;
        let spec = store::load(model)?;
        let inputs: Vec<&str> = plant.inputs().iter().map(|i| i.column.as_str()).collect();
        let outputs: Vec<&str> = task
            .outputs
            .iter()
            .map(|s| plant.sensors()[*s].column.as_str())
            .collect();
        fits(model, "input", &spec.inputs, &inputs, &rig)?;
        fits(model, "output", &spec.outputs, &outputs, &rig)?;
        Ok(Self { plant, task, spec })
    }

    /// What runs of this loop share.
    pub fn bench(&self, seed: u64) -> Bench<'_> {
        Bench {
            disturbance: Disturbance::None,
            plant: &self.plant,
            task: &self.task,
            seed,
        }
    }

    /// Units of the outputs.
    pub fn units(&self) -> impl Iterator<Item = &str> {
        self.task.units(&self.plant)
    }

    /// Runs of this loop side by side.
    pub fn results<'a>(&'a self, entries: Vec<Entry<'a>>) -> Results<'a> {
        let sensors = self.task.outputs.iter().map(|s| &self.plant.sensors()[*s]);
        let inputs = self.plant.inputs().iter().map(|i| i.column.clone());
        Results {
            entries,
            outputs: sensors
                .map(|s| (s.column.clone(), s.unit.clone()))
                .collect(),
            inputs: inputs.collect(),
            limits: &self.task.limits,
            period_s: self.task.period_s,
        }
    }

    /// Writes, builds and runs the firmware.
    ///
    /// # Errors
    /// It does not build or run.
    pub fn run(
        &self,
        bench: &Bench<'_>,
        folder: &Path,
        board: Board,
        cache: Option<&Path>,
        quiet: bool,
        scenario: &Scenario,
    ) -> Result<DeviceRun> {
        project::write(folder, &self.spec)?;
        let built = compile_in(folder, board, cache, quiet)?;
        let stage = Stage::begin(format!("run it on {}", board.name()), quiet);
        let run = bench.on_device(folder, board, &built, fingerprint(&self.spec), scenario)?;
        stage.end(format!("{} steps", run.summary.steps));
        Ok(run)
    }
}

/// The model's signals of one role are the rig's, in number, name and order.
fn fits(model: &Path, role: &str, signals: &[Signal], columns: &[&str], rig: &Rig) -> Result<()> {
    let names: Vec<&str> = signals.iter().map(|s| s.name.as_str()).collect();
    if names == columns {
        return Ok(());
    }
    let path = model.join(store::MODEL_FILE);
    let header = format!("[[{role}]]");
    let text = std::fs::read_to_string(&path).unwrap_or_default();
    let line = text
        .lines()
        .position(|line| line.trim() == header)
        .map_or(1, |line| line + 1);
    let list = |names: &[&str]| format!("{} ({})", names.len(), names.join(", "));
    Err(Error::file(
        &path,
        format!(
            "the network's {role}s do not fit the rig {}: it has {}",
            rig.file,
            list(&names)
        ),
    )
    .at(line, 1)
    .expected(format!("the rig's {role}s: {}", list(columns)))
    .help("train a model for this rig: sinew train"))
}
