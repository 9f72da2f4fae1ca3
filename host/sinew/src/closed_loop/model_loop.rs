//! Models that are there already, put into their loop: what `tune`, `compare` and `pil` share.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sinew_model::spec::{ModelSpec, Signal};
use sinew_model::store;
use sinew_sim::{Plant, Rig};

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::disturbance::Disturbance;
use crate::closed_loop::perturbed_plant::{PerturbedParameter, of_fleet, perturbed};
use crate::closed_loop::plant_program::PlantProgram;
use crate::closed_loop::scenario::Scenario;
use crate::closed_loop::setup::{DeviceRun, PERTURBATION, Setup};
use crate::project::image::Sizes;
use crate::project::{self, Board, Optimise};
use crate::rig_file;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::{read_recording, read_recordings};
use sinew_ident::error::{Error, Result};
use sinew_ident::fleet::parameters;
use sinew_ident::population::Fleet;
use sinew_ident::report::count;

/// Loops that were run on a board.
pub struct BoardRuns {
    /// One a scenario.
    pub runs: Vec<DeviceRun>,
    /// The image by its sections; none on the host.
    pub image: Option<Sizes>,
}

/// A rig's task and the plant of its loop.
pub struct ModelLoop {
    /// The rig's file, for errors.
    rig: String,
    /// The plant of the loop.
    pub plant: Plant,
    /// Its parameters.
    pub values: Vec<f64>,
    /// Those that were moved.
    pub moved: Vec<PerturbedParameter>,
    /// Plants drawn around this one, a loop each; none: `values` alone.
    pub drawn: Vec<Vec<f64>>,
    /// Control problem.
    pub task: ControlProblem,
    /// Disturbance of the commands on their way to the plant.
    pub disturbance: Disturbance,
    /// Age of the measurements when a controller gets them, seconds.
    pub delay_s: f64,
    /// Seed of everything drawn.
    pub seed: u64,
    /// The program that is the plant instead.
    pub program: Option<PlantProgram>,
    /// The fleet that plants are drawn from.
    pub fleet: Option<Fleet>,
}

impl ModelLoop {
    /// Reads the files and checks that they belong together. The plant of the loop is that of
    /// `real` as it is written, or else the rig's with every free parameter moved; the task is the
    /// rig's either way. `quiet` as for [`read_recording`].
    ///
    /// # Errors
    /// A bad file, or a real rig with other inputs or sensors.
    pub fn load(
        rig: &Path,
        real: Option<&Path>,
        fit: &[PathBuf],
        test: &[PathBuf],
        seed: u64,
        quiet: bool,
    ) -> Result<Self> {
        let read = |paths: &[PathBuf]| read_recordings(paths, quiet);
        let rig = rig_file::load(rig)?;
        let plant = Plant::new(&rig)?;
        let (recordings, tests) = (read(fit)?, read(test)?);
        let reference = tests
            .first()
            .or(recordings.last())
            .ok_or_else(|| Error::arguments("no recording").help("name one with --fit"))?;
        let task = ControlProblem::new(&rig, &plant, &recordings, reference)?;
        let (plant, values, moved) = match real {
            None => {
                let (values, moved) = perturbed(&plant, &task.calibrated, PERTURBATION, seed);
                (plant, values, moved)
            }
            Some(path) => {
                let real = Plant::new(&rig_file::load(path)?)?;
                same_signals(path, &real, &rig, &plant)?;
                let values = real.values();
                (real, values, Vec::new())
            }
        };
        Ok(Self {
            rig: rig.file,
            plant,
            values,
            moved,
            drawn: Vec::new(),
            task,
            disturbance: Disturbance::None,
            delay_s: 0.0,
            seed,
            program: None,
            fleet: None,
        })
    }

    /// Reads a model.
    ///
    /// # Errors
    /// A bad file, or signals that are not the rig's.
    pub fn model(&self, model: &Path) -> Result<ModelSpec> {
        let spec = store::load(model).map_err(Error::refused)?;
        let inputs = self.plant.inputs().iter().map(|i| i.column.as_str());
        let sensors = self.plant.sensors();
        let outputs = self.task.outputs.iter();
        let outputs = outputs.map(|s| sensors[*s].column.as_str());
        self.fits(model, "input", &spec.inputs, &inputs.collect::<Vec<_>>())?;
        self.fits(model, "output", &spec.outputs, &outputs.collect::<Vec<_>>())?;
        let channels = self.task.channels.iter();
        let channels = channels.map(|s| sensors[*s].column.as_str());
        self.fits(
            model,
            "channel",
            &spec.channels,
            &channels.collect::<Vec<_>>(),
        )?;
        if spec.soft_sensor.is_some() != self.task.sensed {
            let path = model.join(store::MODEL_FILE);
            let (has, wants) = if self.task.sensed {
                (
                    "no soft sensor",
                    "one: `sensed_by` of [control] names its channels",
                )
            } else {
                (
                    "a soft sensor",
                    "none: `sensed_by` of [control] names no channel",
                )
            };
            return Err(Error::file(path, format!("the model has {has}"))
                .expected(format!("as the rig {} has it, {wants}", self.rig))
                .help("train a model for this rig: sinew train"));
        }
        Ok(spec)
    }

    /// Setup that runs of this loop share.
    pub fn bench(&self) -> Setup<'_> {
        Setup {
            plant: &self.plant,
            task: &self.task,
            seed: self.seed,
            disturbance: self.disturbance,
            delay_s: self.delay_s,
            program: self.program.as_ref(),
            fleet: self.fleet.as_ref(),
        }
    }

    /// Takes a fleet: the plant of the loop is a device that is drawn from it, and so is every
    /// other plant from here on.
    ///
    /// # Errors
    /// A bad file, or parameters that are not the free ones of the rig.
    pub fn take_fleet(&mut self, path: &Path) -> Result<()> {
        let fleet = Fleet::load(path)?;
        fleet.is_of(&self.rig, &parameters(&self.plant))?;
        let calibrated = &self.task.calibrated;
        (self.values, self.moved) = of_fleet(&self.plant, calibrated, &fleet, self.seed);
        self.fleet = Some(fleet);
        Ok(())
    }

    /// Draws `count` plants about the one in the loop: every free parameter is that of the rig or
    /// the real one as written, times 1 - `spread` to 1 + `spread`. With a fleet each is a device
    /// of it.
    pub fn draw(&mut self, spread: f64, count: usize) {
        let of = |k: u64| {
            let seed = self.seed.wrapping_add(4000 + k);
            let calibrated = &self.task.calibrated;
            match &self.fleet {
                None => perturbed(&self.plant, calibrated, (0.0, spread), seed).0,
                Some(fleet) => of_fleet(&self.plant, calibrated, fleet, seed).0,
            }
        };
        self.drawn = (0..count as u64).map(of).collect();
        self.values = self.plant.values();
        self.moved.clear();
    }

    /// Lets a program be the plant; nothing of the rig's is moved. With [`ModelLoop::draw`], it
    /// draws.
    pub fn let_be_the_plant(&mut self, command: &str, spread: f64) {
        self.program = Some(PlantProgram {
            command: command.into(),
            draw: 0,
            spread,
        });
        self.moved.clear();
    }

    /// Asks for the path of a file; `quiet` as for [`read_recording`].
    ///
    /// # Errors
    /// A bad file, or one without a column an output.
    pub fn follow(&mut self, path: &Path, quiet: bool) -> Result<()> {
        self.task.follow(&read_recording(path, quiet)?, &self.plant)
    }

    /// Units of the outputs.
    pub fn units(&self) -> impl Iterator<Item = &str> {
        self.task.units(&self.plant)
    }

    /// Writes, builds and runs the firmware of a model, once a scenario.
    ///
    /// # Errors
    /// It does not build or run.
    pub fn run(
        &self,
        spec: &ModelSpec,
        folder: &Path,
        (board, optimise): (Board, Optimise),
        cache: Option<&Path>,
        quiet: bool,
        scenarios: &[Scenario],
    ) -> Result<BoardRuns> {
        eprint!(
            "{}",
            project::kept(&project::write(folder, spec, optimise)?)
        );
        let built = project::build_shown(folder, board, cache, quiet)?;
        let stage = Stage::begin(format!("run it on {}", board.name()), quiet);
        let bench = self.bench();
        let runs: Vec<DeviceRun> = scenarios
            .par_iter()
            .map(|scenario| bench.on_device(folder, board, &built, spec, scenario))
            .collect::<Result<_>>()?;
        let steps: u32 = runs.iter().map(|run| run.summary.steps).sum();
        stage.end(count(steps as usize, "step"));
        let image = match board {
            Board::Host => None,
            _ => Some(project::image::sizes(&built.lockstep)?),
        };
        Ok(BoardRuns { runs, image })
    }

    /// The model's signals of one role are the rig's, in number, name and order.
    fn fits(&self, model: &Path, role: &str, signals: &[Signal], columns: &[&str]) -> Result<()> {
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
        Err(Error::file(
            &path,
            format!(
                "the network's {role}s do not fit the rig {}: it has {}",
                self.rig,
                list(&names)
            ),
        )
        .at(line, 1)
        .expected(format!("the rig's {role}s: {}", list(columns)))
        .help("train a model for this rig: sinew train"))
    }
}

fn list(names: &[&str]) -> String {
    format!("{} ({})", names.len(), names.join(", "))
}

/// The real rig is driven and read through the same columns, in the same order and units: a
/// controller takes them by place.
fn same_signals(path: &Path, real: &Plant, rig: &Rig, believed: &Plant) -> Result<()> {
    let columns = |plant: &Plant| {
        let inputs = plant.inputs().iter().map(|i| (&i.column, i.column_factor));
        let sensors = plant.sensors().iter().map(|s| (&s.column, s.column_factor));
        let said = |(column, factor): (&String, f64)| match factor {
            1.0 => column.clone(),
            factor => format!("{column} times {factor}"),
        };
        inputs.chain(sensors).map(said).collect::<Vec<String>>()
    };
    let (has, wants) = (columns(real), columns(believed));
    if has == wants {
        return Ok(());
    }
    let list = |columns: &[String]| list(&columns.iter().map(String::as_str).collect::<Vec<_>>());
    Err(
        Error::file(path, format!("its inputs and sensors are {}", list(&has))).expected(format!(
            "those of {}: {}",
            rig.file,
            list(&wants)
        )),
    )
}
