//! The whole chain: a rig and recordings in, a controller that has run on a board out.

use std::path::PathBuf;
use std::time::Instant;

use sinew_model::spec::ModelSpec;
use sinew_mpc::feedback::pid::PidState;
use sinew_sim::{Plant, Rig};

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::disturbance::Disturbance;
use crate::closed_loop::perturbed_plant::PerturbedParameter;
use crate::closed_loop::scenario::Scenario;
use crate::closed_loop::setup::{DeviceRun, PidRun, Setup, TUNING_PLANTS, same_bits};
use crate::pipeline::kept_pid::KeptPids;
use crate::pipeline::learn::Record;
use crate::pipeline::predictor::{self, Predictor, predictor};
use crate::pipeline::summary::ModelRig;
use crate::project::{self, Board, Built, Optimise, Sizes};
use crate::rig_file;
use sinew_ident::check::Check;
use sinew_ident::cli::colour;
use sinew_ident::cli::fit::fleet as read_fleet;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::Repairs;
use sinew_ident::diagnose::{DiagnoseOptions, Diagnosis, Recordings, diagnose};
use sinew_ident::error::{Error, Result};
use sinew_ident::fit::{Fit, FitOptions, FreeRun, fit, free_runs, require};
use sinew_ident::population::Fleet;
use sinew_ident::recording::Recording;
use sinew_ident::report::{shared_values, warnings};

/// Inputs and settings of the pipeline.
#[derive(Clone, Debug)]
pub struct Request {
    /// The rig file.
    pub rig: PathBuf,
    /// Recordings that estimate.
    pub fit: Vec<PathBuf>,
    /// Recordings that are only scored.
    pub test: Vec<PathBuf>,
    /// The fleet that the device is of: prior of the fit, and source of every plant that trains,
    /// tunes and compares.
    pub fleet: Option<PathBuf>,
    /// Repairs of all of them, and faults that are not refused.
    pub repairs: Repairs,
    /// Board of the controller.
    pub board: Board,
    /// Optimisation goal of its image.
    pub optimise: Optimise,
    /// Folder of everything that is written.
    pub out: PathBuf,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Folder of cargo's build outputs; `out/target` without one.
    pub cache: Option<PathBuf>,
    /// Also say what physics the rig lacks, and make the controller for the rig that has it.
    pub diagnose: bool,
    /// The kind of effect that is known to be missing, where somebody concealed one.
    pub hidden: Option<String>,
    /// No progress.
    pub quiet: bool,
}

/// A signal before and after the fit, on one recording.
pub struct Fitted {
    /// `fit` or `test`.
    pub role: &'static str,
    /// The recording.
    pub recording: Recording,
    /// The rig as written.
    pub before: FreeRun,
    /// The rig refitted.
    pub after: FreeRun,
}

/// Everything that the chain found out.
pub struct Outcome {
    /// The rig's name.
    pub name: String,
    /// The fit.
    pub fit: Fit,
    /// Diagnosis of the rig, if it was asked for.
    pub diagnosis: Option<Diagnosis>,
    /// The rig that network, tuning and plant of the loop come from.
    pub model_rig: ModelRig,
    /// The kind of effect that is known to be missing.
    pub hidden: Option<String>,
    /// Free runs on every recording.
    pub free_runs: Vec<Fitted>,
    /// Signals that the refitted rig does not explain, a sentence each.
    pub doubts: Vec<String>,
    /// The task.
    pub task: ControlProblem,
    /// Units of the outputs.
    pub units: Vec<String>,
    /// Columns of the inputs.
    pub inputs: Vec<String>,
    /// Units of the inputs.
    pub input_units: Vec<String>,
    /// Columns of the outputs.
    pub outputs: Vec<String>,
    /// The model with its tuned settings.
    pub spec: ModelSpec,
    /// Record of the training.
    pub record: Record,
    /// The model came from an earlier run on the same files.
    pub reused: bool,
    /// File of the fleet that the plants are drawn from.
    pub fleet: Option<PathBuf>,
    /// Parameters of the plant that differ from the model's.
    pub moved: Vec<PerturbedParameter>,
    /// Board of the controller.
    pub board: Board,
    /// Optimisation goal of its image.
    pub optimise: Optimise,
    /// Its run.
    pub mpc: DeviceRun,
    /// The run of the PID tuned on the plant of the loop; where there is none, the reason.
    pub pid: Result<PidRun>,
    /// The run of the PID tuned on the plants that the MPC was tuned on; as [`Outcome::pid`].
    pub informed_pid: Result<PidRun>,
    /// The board's commands have the bits of the host's; `None` where the host is the board.
    pub host_equals_device: Option<bool>,
    /// Sizes of the image; `None` on the host.
    pub sizes: Option<Sizes>,
    /// Wall time, seconds.
    pub seconds: f64,
}

/// Runs the chain; leaves `out/rig.toml`, `out/model/`, `out/firmware/`, `out/boards/`,
/// `out/images/`.
///
/// # Errors
/// [`Error`] from any link, with the file that it is about.
pub fn build(request: &Request) -> Result<Outcome> {
    let begun = Instant::now();
    let (rig, recordings, tests) = load(request)?;
    // Tuning runs the firmware on this computer.
    project::ready(Board::Host)?;
    project::ready(request.board)?;
    project::is_free(&request.out)?;
    let all = recordings.iter().chain(&tests);
    require(&rig, all.clone())?;
    let checks = request.repairs.before(&rig, all, request.quiet)?;
    let fleet = read_fleet(request.fleet.as_deref(), &rig)?;
    let identified = identify(request, &rig, fleet.clone(), (&recordings, &tests))?;
    let diagnosis = if request.diagnose {
        Some(find(request, &rig, checks, (&recordings, &tests))?)
    } else {
        None
    };

    // What was found missing is known from here on: to the network, the tuning and the plant.
    let corrected = diagnosis.as_ref().filter(|found| !found.effects.is_empty());
    let (model_rig, rig_of_model) = match corrected {
        Some(found) => (ModelRig::Corrected, &found.mended),
        None => (ModelRig::Fitted, &identified.fitted.rig),
    };
    let plant = Plant::new(rig_of_model)?;
    let reference = tests
        .first()
        .or(recordings.last())
        .ok_or_else(no_recording)?;
    let task = ControlProblem::new(rig_of_model, &plant, &recordings, reference)?;
    let bench = Setup {
        plant: &plant,
        task: &task,
        seed: request.seed,
        disturbance: Disturbance::None,
        delay_s: 0.0,
        program: None,
        fleet: fleet.as_ref(),
    };
    let Predictor {
        spec,
        record,
        reused,
    } = predictor(
        rig_of_model,
        &recordings,
        &bench,
        (&request.out, request.cache.as_deref()),
        request.quiet,
    )?;

    let kept = project::write(&request.out, &spec, request.optimise)?;
    eprint!("{}", project::kept(&kept));
    let host = compile(request, Board::Host)?;
    let board = match request.board {
        Board::Host => host.clone(),
        board => compile(request, board)?,
    };

    let (values, moved) = bench.perturbed_plant();
    let scenario = bench.scenario(&values)?;
    let steps = scenario.reference.steps();
    let stage = Stage::begin(format!("run it on {}", request.board.name()), request.quiet);
    let mpc = bench.on_device(&request.out, request.board, &board, &spec, &scenario)?;
    stage.end(format!("{steps} steps at {:.0} Hz", 1.0 / task.period_s));
    let host_equals_device = match request.board {
        Board::Host => None,
        _ => Some(is_reproduced(
            request,
            &bench,
            (&spec, &host),
            &scenario,
            &mpc,
        )?),
    };
    // The reference may be that of a test recording.
    let all = [&recordings[..], &tests[..]].concat();
    let key = predictor::key(rig_of_model, &all, &bench);
    let [informed_pid, pid] = pids(request, &bench, key, &values, &scenario);
    let sizes = match request.board {
        Board::Host => None,
        _ => Some(project::image::sizes(&board.lockstep)?),
    };
    let sensors = || task.outputs.iter().map(|s| &plant.sensors()[*s]);
    Ok(Outcome {
        name: rig.name.clone(),
        fit: identified.fitted,
        diagnosis,
        model_rig,
        hidden: request.hidden.clone(),
        free_runs: identified.free_runs,
        doubts: identified.doubts,
        units: sensors().map(|s| s.unit.clone()).collect(),
        outputs: sensors().map(|s| s.column.clone()).collect(),
        inputs: plant.inputs().iter().map(|i| i.column.clone()).collect(),
        input_units: plant.inputs().iter().map(|i| i.unit().into()).collect(),
        task,
        spec,
        record,
        reused,
        fleet: request.fleet.clone(),
        moved,
        board: request.board,
        optimise: request.optimise,
        mpc,
        pid,
        informed_pid,
        host_equals_device,
        sizes,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// Diagnoses the rig; leaves `out/mended.toml`.
fn find(
    request: &Request,
    rig: &Rig,
    checks: Vec<Check>,
    (recordings, tests): (&[Recording], &[Recording]),
) -> Result<Diagnosis> {
    let stage = Stage::begin("diagnose what the rig lacks", request.quiet);
    let recordings = Recordings {
        fit: recordings.to_vec(),
        check: Vec::new(),
        test: tests.to_vec(),
    };
    let options = DiagnoseOptions {
        seed: request.seed,
        checks,
        ..DiagnoseOptions::default()
    };
    let told = |what: &str, done: usize, of: usize| stage.count(done, of, what);
    let found = diagnose(rig, &recordings, &options, &told)?;
    let mended = sinew_ident::diagnose::output::mended(&found);
    sinew_files::write(request.out.join("mended.toml"), mended)?;
    stage.end(&found.sentence);
    Ok(found)
}

fn load(request: &Request) -> Result<(Rig, Vec<Recording>, Vec<Recording>)> {
    let rig = rig_file::load(&request.rig)?;
    let (recordings, tests) = (
        request.repairs.read(&request.fit, request.quiet)?,
        request.repairs.read(&request.test, request.quiet)?,
    );
    if recordings.is_empty() {
        return Err(no_recording());
    }
    Ok((rig, recordings, tests))
}

fn no_recording() -> Error {
    Error::arguments("no recording to fit the rig to").help("name one with --fit")
}

/// The fitted rig with its free runs, and what warns of it.
struct Identified {
    fitted: Fit,
    free_runs: Vec<Fitted>,
    doubts: Vec<String>,
}

fn identify(
    request: &Request,
    rig: &Rig,
    fleet: Option<Fleet>,
    (recordings, tests): (&[Recording], &[Recording]),
) -> Result<Identified> {
    let options = FitOptions {
        fleet,
        ..FitOptions::default()
    };
    let stage = Stage::begin("fit the rig to the recordings", request.quiet);
    let fitted = fit(rig, recordings, &options, &mut |p| {
        stage.say(format!(
            "stage {}, step {}, {:.2} % of the signal",
            p.stage,
            p.step,
            100.0 * p.error
        ));
    })?;
    sinew_files::write(request.out.join("rig.toml"), fitted.rig.to_toml())?;
    let free_runs = all_free_runs(rig, &fitted, (recordings, tests))?;
    stage.end(fit_sentence(&fitted));
    let mut doubts = doubts(&fitted);
    if request.diagnose {
        // It comes next, and says what is missing.
        doubts.retain(|doubt| !doubt.contains("`sinew diagnose` looks for"));
    }
    if !request.quiet {
        // Before minutes go into what is made on it.
        doubts
            .iter()
            .for_each(|doubt| colour::on_error(format!("  warning: {doubt}")));
    }
    Ok(Identified {
        fitted,
        free_runs,
        doubts,
    })
}

/// Runs the scenario on this computer too, and compares the commands' bits with those of the board.
fn is_reproduced(
    request: &Request,
    bench: &Setup<'_>,
    (spec, host): (&ModelSpec, &Built),
    scenario: &Scenario,
    on_board: &DeviceRun,
) -> Result<bool> {
    let stage = Stage::begin("run it on this computer", request.quiet);
    let same = bench.on_device(&request.out, Board::Host, host, spec, scenario)?;
    let equal = same_bits(&on_board.answers, &same.answers);
    stage.end(if equal { "the same bits" } else { "OTHER bits" });
    Ok(equal)
}

/// Runs of the PID tuned on the plants that tuned the MPC, and on the plant of the loop, which has
/// these values. `key`: of the gains that are kept.
fn pids(
    request: &Request,
    bench: &Setup<'_>,
    key: u64,
    values: &[f64],
    scenario: &Scenario,
) -> [Result<PidRun>; 2] {
    let mut kept = KeptPids::open(request.out.join("pid.json"), key);
    let mut pid = |on: &str, plants: &[Vec<f64>]| {
        let stage = Stage::begin("tune and run the PID", request.quiet);
        let tuned = kept.tuned(bench, plants);
        let run = tuned.and_then(|(tuning, reused)| {
            Ok((bench.run_baseline::<PidState>(tuning, scenario)?, reused))
        });
        stage.end(match &run {
            Ok((_, true)) => format!("{on}, as before"),
            Ok((_, false)) => on.to_owned(),
            Err(_) => "none".to_owned(),
        });
        run.map(|(pid, _)| pid)
    };
    let informed = pid(
        "on the plants that tuned the MPC",
        &bench.tuning_plants(TUNING_PLANTS),
    );
    let very = [values.to_vec(), values.to_vec()];
    let very = pid("on the plant that it is judged on", &very);
    [informed, very]
}

/// The free runs of the fit, and those of both rigs over the recordings that are only scored.
fn all_free_runs(
    before: &Rig,
    fit: &Fit,
    (recordings, tests): (&[Recording], &[Recording]),
) -> Result<Vec<Fitted>> {
    let of_role = |role: &'static str, recordings: &[Recording], runs: [&[FreeRun]; 2]| {
        let pairs = runs[0].iter().zip(runs[1]).zip(recordings);
        let fitted = pairs.map(|((before, after), recording)| Fitted {
            role,
            recording: recording.clone(),
            before: before.clone(),
            after: after.clone(),
        });
        fitted.collect::<Vec<Fitted>>()
    };
    let mut runs = of_role("fit", recordings, [&fit.as_written_runs, &fit.runs]);
    let [before, after] = [before, &fit.rig].map(|rig| free_runs(rig, tests));
    runs.extend(of_role("test", tests, [&before?, &after?]));
    Ok(runs)
}

/// Signals that the refitted rig does not explain, on the recordings of the fit, and values that
/// are taken for all recordings.
fn doubts(fit: &Fit) -> Vec<String> {
    warnings(fit)
        .into_iter()
        .chain(shared_values(&fit.rig))
        .collect()
}

fn fit_sentence(fit: &Fit) -> String {
    match fit.sensors.first() {
        Some(sensor) => format!(
            "{} {} → {}",
            sensor.signal,
            sinew_ident::report::quantity(sensor.as_written_rms, &sensor.unit),
            sinew_ident::report::quantity(sensor.rms, &sensor.unit)
        ),
        None => "no sensor".into(),
    }
}

fn compile(request: &Request, board: Board) -> Result<Built> {
    project::build_shown(&request.out, board, request.cache.as_deref(), request.quiet)
}
