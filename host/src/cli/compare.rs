//! `sinew compare`: predictive controllers beside a tuned PID and a tuned RISE, on one plant.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::RangedU64ValueParser;
use serde_json::{Map, Value, json};
use sinew_firmware::pid::PidState;
use sinew_firmware::rise::RiseState;

use super::{LoopArguments, overwrite};
use crate::chain::built::Loop;
use crate::chain::contest::Contest;
use crate::chain::contestant::Contestant;
use crate::compare::closed_loop::Scenario;
use crate::compare::disturbance::Disturbance;
use crate::compare::feedback::{Opponent, Tuning};
use crate::error::{Error, Result};
use crate::progress::Stage;
use crate::project::Board;
use crate::report::{quantity, sheet};

/// Arguments of `sinew compare`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Folder of a model: model.toml and weights.safetensors; several are compared, each called by its folder's name.
    #[arg(required = true)]
    models: Vec<PathBuf>,
    /// The rig file of the plant in the loop, taken as written; without it, RIG with every free parameter moved.
    #[arg(long, value_name = "RIG")]
    plant: Option<PathBuf>,
    /// Loops a controller; all but the first have other noise and other moves.
    #[arg(long, value_name = "N", default_value = "1", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    loops: usize,
    /// What is added to the commands on their way to the plant; no controller is told of it.
    #[arg(long, value_enum, default_value = "none")]
    disturbance: Disturbance,
    /// Where the models run; commands of another board must have the bits of this computer's.
    #[arg(long, value_enum, default_value = "host")]
    board: Board,
    /// Where the scores are written for programs (sinew-comparison/1).
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Where a page with plots is written.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Where the tracking error over the first loop is drawn.
    #[arg(long, value_name = "SVG")]
    plot: Option<PathBuf>,
}

/// # Errors
/// A bad file, or a model that does not fit the rig.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let names = names(&arguments.models)?;
    let recordings = &of_loop.recordings;
    let recordings = recordings.fit.iter().chain(&recordings.test);
    let read = std::iter::once(("RIG", of_loop.rig.as_path()))
        .chain(arguments.plant.iter().map(|p| ("--plant", p.as_path())))
        .chain(recordings.map(|p| ("a recording", p.as_path())));
    overwrite::refuse(
        read,
        [
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
            ("--plot", arguments.plot.as_deref()),
        ],
    )?;
    let mut ready = of_loop.load(arguments.plant.as_deref())?;
    ready.disturbance = arguments.disturbance;
    let quiet = of_loop.common.quiet;
    let specs = arguments
        .models
        .iter()
        .map(|model| ready.model(model))
        .collect::<Result<Vec<_>>>()?;
    let bench = ready.bench();
    let scenarios = bench.scenarios(&ready.values, arguments.loops)?;
    let mut controllers = Vec::new();
    for (name, spec) in names.into_iter().zip(&specs) {
        let folder = match specs.len() {
            1 => of_loop.out.clone(),
            _ => of_loop.out.join(&name),
        };
        let run = |board, scenarios| of_loop.run(&ready, spec, &folder, board, scenarios);
        let on_board = match arguments.board {
            Board::Host => None,
            board => Some(run(board, &scenarios)?),
        };
        let loops = run(Board::Host, &scenarios)?;
        controllers.push(Contestant::mpc(
            name,
            loops,
            on_board.as_deref(),
            &ready.task,
        )?);
    }
    let mut gains = Map::new();
    opponent::<PidState>(&ready, &scenarios, quiet, &mut controllers, &mut gains)?;
    opponent::<RiseState>(&ready, &scenarios, quiet, &mut controllers, &mut gains)?;

    println!("reference: {}", ready.task.reference_source);
    for m in &ready.moved {
        println!(
            "{:<32} {:>14} in the model, {:>14} in the plant",
            m.name,
            quantity(m.fitted, &m.unit),
            quantity(m.plant, &m.unit)
        );
    }
    let plant = arguments.plant.as_deref();
    let board = arguments.board.name();
    let contest = Contest::new(&ready, &of_loop.rig, plant, board, controllers, gains);
    print!("{}", contest.table().text());
    if let Some(path) = &arguments.json {
        crate::atomic::write(path, format!("{:#}\n", contest.value()?))?;
        println!("{}", path.display());
    }
    if let Some(path) = &arguments.report {
        let command = format!("sinew compare {}", of_loop.rig.display());
        contest.report(&command).write(path)?;
        println!("{}", path.display());
    }
    if let Some(path) = &arguments.plot {
        crate::atomic::write(path, sheet(&contest.errors()))?;
        println!("{}", path.display());
    }
    Ok(())
}

/// Tunes a controller without a model on the plant that it is judged on, and runs it; what inputs and outputs that do
/// not pair off withhold is no reason to withhold the others.
fn opponent<L: Opponent>(
    ready: &Loop,
    scenarios: &[Scenario],
    quiet: bool,
    controllers: &mut Vec<Contestant>,
    gains: &mut Map<String, Value>,
) -> Result<()> {
    let stage = Stage::begin(format!("tune and run the {}", L::NAME), quiet);
    let bench = ready.bench();
    let tuning = match bench.tuned::<L>(&ready.values) {
        Ok(tuning) => tuning,
        Err(reason) => {
            stage.end(format!("none: {reason}"));
            return Ok(());
        }
    };
    let runs = scenarios
        .iter()
        .map(|scenario| Ok(bench.run_opponent::<L>(tuning.clone(), scenario)?.run));
    let runs = runs.collect::<Result<Vec<_>>>()?;
    controllers.push(Contestant::new(L::NAME, runs, &ready.task)?);
    gains.insert(L::NAME.into(), by_name::<L>(&tuning));
    stage.end("on the plant that it is judged on");
    Ok(())
}

/// Gains by name, one object a channel.
pub(super) fn by_name<L: Opponent>(tuning: &[Tuning<L::Gains>]) -> Value {
    let channels = tuning.iter().map(|tuning| {
        let mut named: Map<_, _> = L::named(&tuning.gains)
            .into_iter()
            .map(|(name, value)| (name.to_string(), json!(value)))
            .collect();
        named.insert("lead_steps".into(), json!(tuning.lead));
        Value::from(named)
    });
    channels.collect()
}

/// What a table calls the models: `MPC`, or with several of them their folders' names.
fn names(models: &[PathBuf]) -> Result<Vec<String>> {
    if models.len() == 1 {
        return Ok(vec!["MPC".into()]);
    }
    let name = |model: &Path| model.file_name().map(|n| n.to_string_lossy().into_owned());
    let mut names: Vec<String> = Vec::new();
    for model in models {
        let name = name(model).unwrap_or_default();
        if name.is_empty()
            || [PidState::NAME, RiseState::NAME].contains(&name.as_str())
            || names.contains(&name)
        {
            let message = format!(
                "{}: several models need folders with names of their own",
                model.display()
            );
            return Err(
                Error::arguments(message).help("they name rows of the table, and folders of --out")
            );
        }
        names.push(name);
    }
    Ok(names)
}
