//! `sinew compare`: predictive controllers beside a tuned PID and a tuned RISE, on one plant.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::RangedU64ValueParser;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use sinew_mpc::feedback::pid::PidState;
use sinew_mpc::feedback::rise::RiseState;

use super::LoopArguments;
use super::conditions::Conditions;
use crate::closed_loop::baseline::{BaselineController, Tuning};
use crate::closed_loop::benchmark::{Benchmark, tuned_on};
use crate::closed_loop::controller_result::ControllerResult;
use crate::closed_loop::model_loop::ModelLoop;
use crate::closed_loop::policy::{self, PolicyController};
use crate::closed_loop::scenario::Scenario;
use crate::closed_loop::setup::BUDGET;
use crate::project::Board;
use crate::tuning::optimise::Budget;
use sinew_ident::cli::exit_code::{FOUND, UNEXPLAINED};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{Provenance, quantity, sheet};

/// Arguments of `sinew compare`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Folder of a model: model.toml and weights.safetensors.
    ///
    /// Several are compared, each called by the name of its folder.
    #[arg(required = true)]
    models: Vec<PathBuf>,
    /// Folder of a policy that `sinew imitate` made, compared as well; may be repeated.
    #[arg(long, value_name = "DIR")]
    policy: Vec<PathBuf>,
    /// The rig file of the plant in the loop, taken as written.
    ///
    /// Without it, RIG with every free parameter moved.
    #[arg(long, value_name = "RIG")]
    plant: Option<PathBuf>,
    /// A program that is the plant instead, as a line for `sh`.
    ///
    /// With --draws it is told which of its plants is wanted.
    #[arg(long, value_name = "COMMAND", conflicts_with = "plant")]
    plant_program: Option<String>,
    /// Loops a controller; all but the first have other noise and other moves.
    #[arg(long, value_name = "N", default_value = "1", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    loops: usize,
    /// Loops a controller, each with the same reference on another plant.
    ///
    /// Every free parameter of --plant, or of RIG, is drawn within --spread.
    #[arg(long, value_name = "N", conflicts_with = "loops", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    draws: Option<usize>,
    /// Largest relative deviation of a drawn parameter.
    #[arg(
        long,
        value_name = "FRACTION",
        requires = "draws",
        default_value_t = 0.2
    )]
    spread: f64,
    /// The fleet that plants are drawn from (sinew-fleet/1), in place of --spread.
    ///
    /// Without --draws the plant is one device of it.
    #[arg(long, value_name = "TOML", conflicts_with_all = ["plant", "plant_program", "spread"])]
    fleet: Option<PathBuf>,
    #[command(flatten)]
    conditions: Conditions,
    /// Judge errors, effort and time at limits between these times only.
    ///
    /// A path may begin or end where a plant that was drawn cannot rest. Commands have to stay
    /// inside their limits all the time.
    #[arg(long, value_name = "FROM,TO", value_delimiter = ',', num_args = 1)]
    judged: Vec<f64>,
    /// Evaluations that tuning PID and RISE may cost each.
    ///
    /// For a plant that is slow to simulate; otherwise some thousands.
    #[arg(long, value_name = "COUNT", value_parser = RangedU64ValueParser::<usize>::new().range(20..))]
    evaluations: Option<usize>,
    /// Most steps that PID and RISE may look ahead at the reference (0: none).
    ///
    /// Without it as many as the horizon, and never more.
    #[arg(long, value_name = "STEPS")]
    longest_lead: Option<usize>,
    /// Board of the models; commands of another board must have the bits of this computer's.
    #[arg(long, value_enum, default_value = "host")]
    board: Board,
    /// File for the scores as JSON (sinew-comparison/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// End with status 3 where PID or RISE tracks better, with 4 for a command outside limits.
    #[arg(long)]
    exit_code: bool,
    /// File for a page: plots and results.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// File for a plot of the tracking error over the first loop.
    #[arg(long, value_name = "SVG")]
    plot: Option<PathBuf>,
    /// File for the first loop of the first model as it was measured: a recording.
    #[arg(long, value_name = "CSV")]
    recording: Option<PathBuf>,
}

/// Returns the exit status.
///
/// # Errors
/// A bad file, or a model that does not fit the rig.
pub fn run(arguments: &Arguments) -> Result<u8> {
    let of_loop = &arguments.of_loop;
    let names = names(&arguments.models)?;
    let policies = policies(&arguments.policy, &names)?;
    let recordings = &of_loop.recordings;
    let recordings = recordings.fit.iter().chain(&recordings.test);
    arguments.conditions.refuse()?;
    judged(&arguments.judged, f64::INFINITY)?;
    if !(0.0..1.0).contains(&arguments.spread) {
        let expectation = "a fraction of a parameter in [0, 1)";
        return Err(Error::must_be("--spread", expectation, arguments.spread)
            .help("for example --spread 0.2: from 20 % below to 20 % above"));
    }
    let read = std::iter::once(("RIG", of_loop.rig.as_path()))
        .chain(arguments.plant.iter().map(|p| ("--plant", p.as_path())))
        .chain(arguments.fleet.iter().map(|p| ("--fleet", p.as_path())))
        .chain(
            arguments
                .conditions
                .reference
                .iter()
                .map(|p| ("--reference", p.as_path())),
        )
        .chain(recordings.map(|p| ("a recording", p.as_path())));
    overwrite::refuse(
        read,
        [
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
            ("--plot", arguments.plot.as_deref()),
            ("--recording", arguments.recording.as_deref()),
        ],
    )?;
    let mut ready = of_loop.load(arguments.plant.as_deref())?;
    arguments
        .conditions
        .apply(&mut ready, of_loop.common.quiet)?;
    if let Some(fleet) = &arguments.fleet {
        ready.take_fleet(fleet)?;
    }
    ready.task.judged_s = judged(&arguments.judged, ready.task.duration_s())?;
    if let Some(longest) = arguments.longest_lead {
        ready.task.longest_lead = longest.min(ready.task.preview());
    }
    if let Some(command) = &arguments.plant_program {
        ready.let_be_the_plant(command, arguments.spread);
    }
    if let Some(count) = arguments.draws {
        ready.draw(arguments.spread, count);
    }
    let quiet = of_loop.common.quiet;
    let specs = arguments
        .models
        .iter()
        .map(|model| ready.model(model))
        .collect::<Result<Vec<_>>>()?;
    let policies = policies
        .into_iter()
        .map(|(name, folder)| Ok((name, policy::read(folder, &ready.plant, &ready.task)?)))
        .collect::<Result<Vec<_>>>()?;
    let bench = ready.bench();
    let scenarios = match ready.drawn.as_slice() {
        [] => bench.scenarios(&ready.values, arguments.loops)?,
        drawn => bench.scenarios_of(drawn)?,
    };
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
        let judged = ControllerResult::mpc(name, loops.runs, on_board.as_ref(), &ready.task)?;
        controllers.push(ControllerResult {
            parameters: Some(spec.parameters()),
            ..judged
        });
    }
    for (name, spec) in &policies {
        let runs = scenarios.par_iter();
        let runs = runs.map(|scenario| scenario.run(&mut PolicyController::new(spec)));
        let runs = runs.collect::<Result<Vec<_>>>()?;
        controllers.push(ControllerResult {
            parameters: Some(spec.network.parameters()),
            ..ControllerResult::new(name, runs, &ready.task)?
        });
    }
    let mut gains = Map::new();
    let budget = arguments.evaluations.map_or(BUDGET, Budget::Apart);
    let mut others = Others {
        ready: &ready,
        scenarios: &scenarios,
        budget,
        quiet,
        controllers: &mut controllers,
        gains: &mut gains,
    };
    others.with::<PidState>()?;
    others.with::<RiseState>()?;

    let said = Said::beside(
        [
            arguments.json.as_deref(),
            arguments.report.as_deref(),
            arguments.plot.as_deref(),
            arguments.recording.as_deref(),
        ],
        of_loop.common.quiet,
    );
    said.line(format!("reference: {}", ready.task.reference_source));
    for m in &ready.moved {
        said.line(format!(
            "{:<32} {:>14} in the model, {:>14} in the plant",
            m.name,
            quantity(m.fitted, &m.unit),
            quantity(m.plant, &m.unit)
        ));
    }
    let plant = arguments.plant.as_ref().map(|p| p.display().to_string());
    let plant = plant.or(arguments.plant_program.clone());
    let board = arguments.board.name();
    let of_box = arguments.draws.filter(|_| arguments.fleet.is_none());
    let spread = of_box.map(|_| arguments.spread);
    let fleet = arguments.fleet.as_ref().map(|p| p.display().to_string());
    let benchmark = Benchmark::new(&ready, &of_loop.rig, plant, board, controllers, gains)
        .spread(spread)
        .fleet(fleet)
        .evaluations(arguments.evaluations);
    let benchmark = match arguments.board {
        Board::Host => benchmark,
        _ => benchmark.optimise(of_loop.optimise),
    };
    said.line(benchmark.table().text().trim_end());
    if arguments.evaluations.is_some() {
        said.line(benchmark.tuning_sentence());
    }
    if let Some(path) = &arguments.json {
        sinew_files::write(path, format!("{:#}\n", benchmark.value()?))?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.report {
        let made = Provenance::typed().seed(of_loop.common.seed);
        let page = benchmark.report(&made);
        match next(&arguments.models) {
            Some(next) => page.next(next).write(path)?,
            None => page.write(path)?,
        }
        said.wrote(path);
    }
    if let Some(path) = &arguments.plot {
        sinew_files::write(path, sheet(&benchmark.errors()))?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.recording {
        let first = &benchmark.controllers[0].first;
        first
            .recording(&ready.plant, &ready.task.outputs, path)?
            .write(path)?;
        said.wrote(path);
    }
    said.next(next(&arguments.models).unwrap_or("sinew emit MODEL --out firmware".into()));
    Ok(if arguments.exit_code {
        exit_code(&benchmark.controllers)
    } else {
        0
    })
}

/// Command line that comes next, where one model was compared.
fn next(models: &[PathBuf]) -> Option<String> {
    let [model] = models else {
        return None;
    };
    Some(format!("sinew emit {} --out firmware", model.display()))
}

/// Exit status of the controllers by their first output, in the median loop.
fn exit_code(controllers: &[ControllerResult]) -> u8 {
    let mut loops = controllers.iter().flat_map(|c| &c.loops);
    let outside = loops.any(|l| l.score.outside_limits > 0);
    let errors_of = |models: bool| {
        let asked = controllers
            .iter()
            .filter(|c| c.parameters.is_some() == models);
        asked.map(|c| c.rms(0).0).collect::<Vec<f64>>()
    };
    status(outside, &errors_of(true), &errors_of(false))
}

/// 0 where the first model's error is at most that of every controller without a model; 3 where it
/// is not; 4 where any command was outside its limits.
fn status(outside: bool, models: &[f64], baselines: &[f64]) -> u8 {
    let leads = |error: &f64| baselines.iter().all(|baseline| error <= baseline);
    match (outside, models.first().is_some_and(leads)) {
        (true, _) => UNEXPLAINED,
        (false, true) => 0,
        (false, false) => FOUND,
    }
}

/// The times between which loops are judged; `duration_s` of the reference, once it is known.
fn judged(asked: &[f64], duration_s: f64) -> Result<Option<[f64; 2]>> {
    let within = |from: f64, to: f64| 0.0 <= from && from < to && from < duration_s;
    match *asked {
        [] => Ok(None),
        [from, to] if within(from, to) => Ok(Some([from, to])),
        _ => {
            let given: Vec<String> = asked.iter().map(f64::to_string).collect();
            let within = if duration_s.is_finite() {
                format!(", the first before the reference ends at {duration_s:.1} s")
            } else {
                String::new()
            };
            let expectation = format!("FROM,TO in seconds, the earlier one first{within}");
            Err(Error::must_be("--judged", expectation, given.join(","))
                .help("for example --judged 2.5,19"))
        }
    }
}

/// Tunes a controller without a model on the plant that it is judged on, and runs it; what inputs
/// and outputs that do not pair off withhold is no reason to withhold the others.
struct Others<'a> {
    ready: &'a ModelLoop,
    scenarios: &'a [Scenario],
    budget: Budget,
    quiet: bool,
    controllers: &'a mut Vec<ControllerResult>,
    gains: &'a mut Map<String, Value>,
}

impl Others<'_> {
    fn with<L: BaselineController>(&mut self) -> Result<()> {
        let stage = Stage::begin(format!("tune and run the {}", L::NAME), self.quiet);
        let bench = self.ready.bench();
        // Twice the one plant, with other moves; of plants that were drawn the middle one and the
        // first two.
        let middle = std::iter::once(&self.ready.values);
        let plants: Vec<Vec<f64>> = match self.ready.drawn.as_slice() {
            [] => vec![self.ready.values.clone(); 2],
            drawn => middle.chain(drawn.iter().take(2)).cloned().collect(),
        };
        let tuning = match bench.tuned::<L>(&plants, self.budget) {
            Ok(tuning) => tuning,
            Err(reason) => {
                stage.end(format!("none: {reason}"));
                return Ok(());
            }
        };
        let runs = self.scenarios.par_iter();
        let runs = runs.map(|s| Ok(bench.run_baseline::<L>(tuning.clone(), s)?.run));
        let runs = runs.collect::<Result<Vec<_>>>()?;
        let judged = ControllerResult::new(L::NAME, runs, &self.ready.task)?;
        self.controllers.push(judged);
        self.gains.insert(L::NAME.into(), by_name::<L>(&tuning));
        stage.end(tuned_on(self.ready));
        Ok(())
    }
}

/// Gains by name, one object a channel.
pub(super) fn by_name<L: BaselineController>(tuning: &[Tuning<L::Gains>]) -> Value {
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

/// Names of the policies in tables: `policy`, or with several of them their folders' names.
fn policies<'a>(folders: &'a [PathBuf], models: &[String]) -> Result<Vec<(String, &'a Path)>> {
    if let [folder] = folders {
        return Ok(vec![("policy".into(), folder)]);
    }
    let mut all: Vec<(String, &Path)> = Vec::new();
    for folder in folders {
        let name = folder.file_name();
        let name = name.map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let taken = models.contains(&name) || all.iter().any(|(other, _)| *other == name);
        if name.is_empty() || taken {
            let message = format!(
                "{}: several policies need folders with names of their own",
                folder.display()
            );
            return Err(Error::arguments(message).help("they name rows of the table"));
        }
        all.push((name, folder));
    }
    Ok(all)
}

/// Names of the models in tables: `MPC`, or with several of them their folders' names.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statuses_are_those_of_the_reference() {
        assert_eq!(status(false, &[1.0], &[2.0, 1.0]), 0);
        assert_eq!(status(false, &[1.0, 0.1], &[2.0, 0.5]), 3);
        assert_eq!(status(false, &[1.0], &[]), 0);
        assert_eq!(status(false, &[f64::NAN], &[2.0]), 3);
        assert_eq!(status(true, &[1.0], &[2.0]), 4);
    }
}
