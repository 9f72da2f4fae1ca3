//! `sinew tune`: weights and horizons of the predictive controller, gains of the PID and RISE, for
//! a stated objective.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value, json};
use sinew_model::spec::ControlSpec;
use sinew_model::store;
use sinew_mpc::MAX_ITERATIONS;
use sinew_mpc::feedback::pid::PidState;
use sinew_mpc::feedback::rise::RiseState;

use super::compare::by_name;
use super::conditions::Conditions;
use super::{Common, Recordings, recording_flags};
use crate::closed_loop::baseline::{BaselineController, Tuning};
use crate::closed_loop::benchmark::Benchmark;
use crate::closed_loop::controller_result::ControllerResult;
use crate::closed_loop::model_loop::ModelLoop;
use crate::closed_loop::setup::TUNING_PLANTS;
use crate::pipeline::learn::save;
use crate::project::{self, Board};
use crate::report::{TuningPage, tuning_page};
use crate::rig_file;
use crate::tuning::control_table::controlled;
use crate::tuning::gradient::levenberg::Ended;
use crate::tuning::objective::Objective;
use crate::tuning::shape::Shape;
use crate::tuning::tune::{
    Gradients, Line, Method, Request, TunedFeedback, tune_feedback, tune_mpc,
};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{Provenance, Table, count, shared_values, significant};

/// Arguments of `sinew tune`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// File for the rig with the tuned [control] table; the rig's own text and comments are kept.
    #[arg(long, value_name = "TOML")]
    out: PathBuf,
    /// Folder for the model with the tuned [control] table, for `compare`, `pil` and `emit`.
    #[arg(long, value_name = "DIR")]
    model_out: Option<PathBuf>,
    /// File for settings and scores as JSON (sinew-tuning/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: objectives, loops before and after, settings.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Objective that is minimised.
    #[arg(long, value_enum, default_value = "tracking")]
    objective: Objective,
    #[command(flatten)]
    conditions: Conditions,
    /// Horizons to try, in steps; otherwise the model's, half of it, and half as much again.
    #[arg(long, value_name = "STEPS", value_delimiter = ',')]
    horizons: Vec<usize>,
    /// Control horizons to try with each of them; otherwise the model's, half of it, and twice it.
    #[arg(long, value_name = "STEPS", value_delimiter = ',')]
    control_horizons: Vec<usize>,
    /// Evaluations of the objective for each controller.
    #[arg(long, value_name = "COUNT", default_value_t = 300)]
    evaluations: usize,
    /// Method of the search.
    ///
    /// PID and RISE have no derivatives: with `gradient` they keep the simplex.
    #[arg(long, value_enum, default_value = "simplex")]
    by: Method,
    /// Plants that each controller is tuned on: the fitted one and others drawn around it.
    #[arg(long, value_name = "COUNT", default_value_t = TUNING_PLANTS)]
    plants: usize,
    /// The fleet that those plants are drawn from (sinew-fleet/1).
    #[arg(long, value_name = "TOML")]
    fleet: Option<PathBuf>,
    /// Keep the gain of the disturbance estimate at this instead of searching it.
    ///
    /// 0 switches the estimate off.
    #[arg(long, value_name = "GAIN")]
    disturbance_gain: Option<f64>,
    /// Most Newton iterations in a control step, 1 to 8, instead of the model's.
    ///
    /// One bounds the longest step: a second follows only where the first was far off.
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u8).range(1..=i64::from(MAX_ITERATIONS)))]
    iterations: Option<u8>,
    /// Search one factor of all move suppression and the gain of the disturbance estimate alone.
    ///
    /// Of inputs that are alike, weights of their own fit the plants of tuning and no other.
    #[arg(long)]
    tied: bool,
    /// Leave PID and RISE as they are.
    #[arg(long)]
    mpc_only: bool,
    /// Folder of cargo's build outputs, if they are to be kept.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// # Errors
/// A bad file, a model that does not fit the rig, a horizon that no firmware could carry.
pub fn run(arguments: &Arguments) -> Result<()> {
    refuse(arguments)?;
    let rig = rig_file::load(&arguments.rig)?;
    let said = Said::beside(
        [
            Some(arguments.out.as_path()),
            arguments.json.as_deref(),
            arguments.report.as_deref(),
        ],
        arguments.common.quiet,
    );
    if let Some(line) = shared_values(&rig) {
        said.line(line);
    }
    let Recordings { fit, test } = &arguments.recordings;
    let (seed, quiet) = (arguments.common.seed, arguments.common.quiet);
    let mut ready = ModelLoop::load(&arguments.rig, None, fit, test, seed, quiet)?;
    arguments.conditions.apply(&mut ready, quiet)?;
    if let Some(fleet) = &arguments.fleet {
        ready.take_fleet(fleet)?;
    }
    let mut believed = ready.model(&arguments.model)?;
    if let Some(value) = ready.task.cost_to_go(&believed.outputs) {
        // Along what is asked for now.
        believed.control.value = Some(value);
        believed.validate().map_err(|e| {
            Error::file(arguments.model.join(store::MODEL_FILE), e.to_string())
                .help("[control] of the rig asks for a cost-to-go: `terminal = \"value\"`")
        })?;
    }
    project::ready(Board::Host)?;
    let bench = ready.bench();
    let shapes = Shape::candidates(&believed, &arguments.horizons, &arguments.control_horizons)?;
    let scenarios = bench.tuning_scenarios(&bench.tuning_plants(arguments.plants))?;
    let request = Request {
        bench: &bench,
        training: bench.training(&scenarios, arguments.objective),
        held_out: &bench.scenario(&ready.values)?,
        evaluations: arguments.evaluations,
        disturbance_gain: arguments.disturbance_gain,
        iterations: arguments.iterations,
        tied: arguments.tied,
        by: arguments.by,
        seed: arguments.common.seed,
        quiet: arguments.common.quiet,
    };
    let folder = tempfile::tempdir()
        .map_err(|e| Error::failed(format!("no temporary folder can be made: {e}")))?;
    let cache = arguments.build_dir.as_deref();
    let (mpc, spec) = tune_mpc(&request, &believed, &shapes, folder.path(), cache)?;
    let mut found = Found {
        lines: vec![mpc],
        ..Found::default()
    };
    if !arguments.mpc_only {
        found.with(tune_feedback::<PidState>(&request)?);
        found.with(tune_feedback::<RiseState>(&request)?);
    }

    let written = controlled(&rig, &spec.control)?;
    sinew_files::write(&arguments.out, written.to_toml())?;
    if let Some(folder) = &arguments.model_out {
        save(folder, &spec)?;
    }

    let objective = format!(
        "objective: {}, of {} over references that are not reported on; reported: {}",
        arguments.objective.name(),
        count(arguments.plants, "plant"),
        ready.task.reference_source
    );
    said.line(&objective);
    said.line(found.objectives().text().trim_end());
    let courses = shapes.iter().zip(&found.lines[0].gradients);
    let courses: Vec<String> = courses.map(|(shape, it)| course(shape, it)).collect();
    for course in &courses {
        said.line(course);
    }
    let contest = Benchmark::new(
        &ready,
        &arguments.rig,
        None,
        Board::Host.name(),
        found.contestants(&ready)?,
        std::mem::take(&mut found.gains),
    );
    said.line(contest.table().text().trim_end());
    let control = &spec.control;
    said.line(format!(
        "MPC: horizon {}, control horizon {}, Q {}, Lambda {}, disturbance gain {}, iterations {}",
        control.horizon,
        control.control_horizon,
        list(&control.tracking_weight),
        list(&control.move_suppression),
        significant(control.disturbance_gain, 3),
        control.iterations
    ));
    if let Some(value) = &control.value {
        said.line(format!(
            "cost-to-go: {}, {} of the reference behind the horizon, {}",
            count(value.rows, "row"),
            count(value.ahead, "row"),
            count(value.points.len(), "operating point")
        ));
    }
    if !found.said.is_empty() {
        said.line(found.said.trim_end());
    }
    said.wrote(&arguments.out);
    if let Some(path) = &arguments.json {
        let mut document = contest.value()?;
        document["format"] = json!("sinew-tuning/1");
        document["objective"] = json!(arguments.objective);
        document["objectives"] = found.lines.iter().map(row).collect();
        document["control"] = json!({
            "horizon": control.horizon,
            "control_horizon": control.control_horizon,
            "tracking_weight": control.tracking_weight,
            "move_suppression": control.move_suppression,
            "disturbance_gain": control.disturbance_gain,
            "iterations": control.iterations,
        });
        sinew_files::write(path, format!("{document:#}\n"))?;
        said.wrote(path);
    }
    let next = next(arguments);
    if let Some(path) = &arguments.report {
        let page = TuningPage {
            rig: &rig.name,
            verdict: found.verdict(),
            next: next.clone().unwrap_or_default(),
            objective,
            objectives: found.objectives(),
            courses,
            settings: settings(control),
            gains: std::mem::take(&mut found.said),
        };
        let made = Provenance::typed().seed(arguments.common.seed);
        tuning_page(&page, &contest, &made).write(path)?;
        said.wrote(path);
    }
    if let Some(next) = next {
        said.next(next);
    }
    Ok(())
}

/// Command line that comes next, where the model was kept.
fn next(arguments: &Arguments) -> Option<String> {
    let model = arguments.model_out.as_ref()?;
    Some(format!(
        "sinew compare {} {}{} --out loop",
        arguments.out.display(),
        model.display(),
        recording_flags(&arguments.recordings)
    ))
}

/// The settings that a tuning writes.
fn settings(control: &ControlSpec) -> Table {
    Table::new("The MPC's [control] table", ["setting", "#value"])
        .row(["horizon, steps", &control.horizon.to_string()])
        .row([
            "control horizon, steps",
            &control.control_horizon.to_string(),
        ])
        .row(["tracking weight Q", &list(&control.tracking_weight)])
        .row(["move suppression Lambda", &list(&control.move_suppression)])
        .row([
            "disturbance gain",
            &significant(control.disturbance_gain, 3),
        ])
        .row(["Newton iterations", &control.iterations.to_string()])
}

/// Results of every controller.
#[derive(Default)]
struct Found {
    lines: Vec<Line>,
    gains: Map<String, Value>,
    said: String,
}

impl Found {
    fn with<L: BaselineController>(&mut self, tuned: TunedFeedback<L>) {
        self.gains
            .insert(L::NAME.into(), by_name::<L>(&tuned.tuning));
        self.said += &said::<L>(&tuned.tuning);
        self.lines.push(tuned.line);
    }

    /// The objective of each controller before and after, where it was tuned and where not.
    fn objectives(&self) -> Table {
        let titles = [
            "controller",
            "#evaluations",
            "#objective, training",
            "#objective, held out",
        ];
        let pair = |[a, b]: [f64; 2]| format!("{} → {}", significant(a, 3), significant(b, 3));
        let table = Table::new("before → tuned", titles);
        self.lines.iter().fold(table, |table, line| {
            table.row([
                line.name.to_string(),
                line.evaluations.to_string(),
                pair(line.training),
                pair([line.held_out[0].cost, line.held_out[1].cost]),
            ])
        })
    }

    /// The tuning in a sentence: the best one on the loop that trained nothing.
    fn verdict(&self) -> String {
        let tuned = |line: &Line| line.held_out[1].cost;
        let best = self
            .lines
            .iter()
            .min_by(|a, b| tuned(a).total_cmp(&tuned(b)));
        let moved = |line: &Line| {
            let [before, after] = [line.held_out[0].cost, line.held_out[1].cost];
            let [before, after] = [before, after].map(|cost| significant(cost, 3));
            format!("{} {before} before, {after} tuned", line.name)
        };
        let all: Vec<String> = self.lines.iter().map(moved).collect();
        let best = best.map_or("", |line| line.name);
        format!(
            "Objective on a loop that tuned nothing: {}. {best} is best.",
            all.join("; ")
        )
    }

    fn contestants(&self, ready: &ModelLoop) -> Result<Vec<ControllerResult>> {
        let mut all = Vec::new();
        for line in &self.lines {
            for (when, held_out) in ["before", "tuned"].iter().zip(&line.held_out) {
                let runs = vec![held_out.run.clone()];
                all.push(ControllerResult::new(
                    format!("{} {when}", line.name),
                    runs,
                    &ready.task,
                )?);
            }
        }
        Ok(all)
    }
}

/// Sentence about a search by gradients.
fn course(shape: &Shape, gradients: &Gradients) -> String {
    let kind = if gradients.exact {
        "with derivatives"
    } else {
        "by differences of the firmware's loops"
    };
    let ended = match gradients.ended {
        Ended::Converged => "converged".to_string(),
        Ended::Exhausted => "the evaluations were used up".to_string(),
        Ended::Stalled => format!(
            "gradients stalled, and a simplex went on from there: {}",
            count(gradients.polished, "evaluation")
        ),
    };
    format!(
        "MPC, {} and {} steps: {} without derivatives, {} {kind}; {ended}",
        shape.horizon, shape.control_horizon, gradients.plain, gradients.linear
    )
}

/// For programs.
fn row(line: &Line) -> Value {
    json!({
        "name": line.name,
        "evaluations": line.evaluations,
        "training": { "before": line.training[0], "after": line.training[1] },
        "held_out": { "before": line.held_out[0].cost, "after": line.held_out[1].cost },
        "gradients": line.gradients.iter().map(|course| json!({
            "objective": course.objective,
            "plain": course.plain,
            "linear": course.linear,
            "derivatives": if course.exact { "exact" } else { "differences" },
            "ended": match course.ended {
                Ended::Converged => "converged",
                Ended::Stalled => "stalled",
                Ended::Exhausted => "exhausted",
            },
            "polished": course.polished,
        })).collect::<Vec<_>>(),
    })
}

/// Before anything is read: what would be overwritten, and a budget that searches nothing.
fn refuse(arguments: &Arguments) -> Result<()> {
    let Recordings { fit, test } = &arguments.recordings;
    arguments.conditions.refuse()?;
    let recordings = fit
        .iter()
        .chain(test)
        .chain(&arguments.conditions.reference)
        .map(|path| ("a recording", path.as_path()));
    let file = |folder: &PathBuf| folder.join(sinew_model::store::MODEL_FILE);
    let model = file(&arguments.model);
    let model_out = arguments.model_out.as_ref().map(file);
    let fleet = arguments.fleet.iter().map(|p| ("--fleet", p.as_path()));
    overwrite::refuse(
        recordings.chain(fleet).chain([
            ("RIG", arguments.rig.as_path()),
            ("MODEL", arguments.model.as_path()),
            ("MODEL", model.as_path()),
        ]),
        [
            ("--out", Some(arguments.out.as_path())),
            ("--model-out", model_out.as_deref()),
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ],
    )?;
    if let Some(gain) = arguments.disturbance_gain
        && !(0.0..=1.0).contains(&gain)
    {
        let expectation = "a share of a prediction's error in [0, 1]";
        return Err(Error::must_be("--disturbance-gain", expectation, gain)
            .help("for example --disturbance-gain 0.2"));
    }
    const MOST_PLANTS: usize = 100;
    if !(1..=MOST_PLANTS).contains(&arguments.plants) {
        let expectation = format!("1 to {MOST_PLANTS}");
        return Err(Error::must_be("--plants", expectation, arguments.plants)
            .help("for example --plants 12"));
    }
    const LEAST: usize = 20;
    if arguments.evaluations < LEAST {
        let expectation = format!("at least {LEAST}, for the starts and a search beyond them");
        return Err(
            Error::must_be("--evaluations", expectation, arguments.evaluations)
                .help("for example --evaluations 300, the default"),
        );
    }
    Ok(())
}

fn list(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|v| significant(*v, 3)).collect();
    format!("[{}]", texts.join(", "))
}

/// `PID 0: kp 12.0, ki 3.00, ..., lead 2 steps`, a line a channel.
fn said<L: BaselineController>(tuning: &[Tuning<L::Gains>]) -> String {
    let lines = tuning.iter().enumerate().map(|(i, tuning)| {
        let named = L::named(&tuning.gains).into_iter();
        let gains: Vec<String> = named
            .map(|(name, value)| format!("{name} {}", significant(value, 3)))
            .collect();
        format!(
            "{} {i}: {}, lead {} steps\n",
            L::NAME,
            gains.join(", "),
            tuning.lead
        )
    });
    lines.collect()
}
