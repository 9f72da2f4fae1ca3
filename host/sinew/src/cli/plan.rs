//! `sinew plan`: open-loop commands through friction, slack, stops and rate limits.

use std::path::PathBuf;

use clap::Args;
use clap::builder::RangedU64ValueParser;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::read_recording;
use sinew_ident::cli::said::Said;
use sinew_ident::error::Result;
use sinew_ident::report::{Provenance, count, significant};
use sinew_plan::{Goal, Options, Plan, plan};
use sinew_sim::Plant;

use super::control_rate_hz;
use crate::{rig_file, view};

/// Arguments of `sinew plan`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML); its actuators' limits and rate limits are kept.
    rig: PathBuf,
    /// A goal such as "mass.position = 0.12 at 1.5 s"; may be repeated.
    ///
    /// The name is that of a sensor, of its column, or of a coordinate. The value is in the
    /// column's unit for a sensor, in SI for a coordinate.
    #[arg(
        long = "goal",
        value_name = "GOAL",
        required_unless_present = "through"
    )]
    goals: Vec<String>,
    /// A path to follow: a table with `t` and columns that name sensors or coordinates.
    #[arg(long, value_name = "CSV")]
    through: Option<PathBuf>,
    /// File for the commands and the signals as simulated: a recording.
    #[arg(long, value_name = "CSV")]
    out: PathBuf,
    /// Weight of effort and of change of the commands, beside squared misses.
    #[arg(long, value_name = "WEIGHT", default_value_t = Options::default().effort, allow_negative_numbers = true)]
    effort: f64,
    /// Duration, s; without it that of the last goal or of the path.
    #[arg(long, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Samples a second; without it the rig's `rate_hz`, or 120.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Simulations at most, one with derivatives counted by its cost.
    #[arg(long, value_name = "N", default_value_t = Options::default().simulations, value_parser = RangedU64ValueParser::<usize>::new().range(10..=1_000_000))]
    simulations: usize,
    /// Knots of each input, between which commands are straight.
    #[arg(long, value_name = "N", default_value_t = Options::default().knots, value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    knots: usize,
    /// Largest miss that counts as reached, as a part of the distance to go.
    #[arg(long, value_name = "FRACTION", default_value_t = Options::default().tolerance, allow_negative_numbers = true)]
    tolerance: f64,
    /// Seed of the samples.
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u64,
    /// File for goals, misses and costs as JSON (sinew-plan/1).
    ///
    /// `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: commands and signals over time.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// Plans, and writes nothing where a goal is missed.
///
/// # Errors
/// Bad arguments or files, a rig that cannot be simulated, a goal that is not reached.
pub fn run(arguments: &Arguments) -> Result<()> {
    let read = [
        ("the rig", Some(&arguments.rig)),
        ("--through", arguments.through.as_ref()),
    ];
    let read = read
        .into_iter()
        .filter_map(|(name, path)| Some((name, path?.as_path())));
    overwrite::refuse(
        read,
        [
            ("--out", Some(arguments.out.as_path())),
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ],
    )?;
    let goals = arguments.goals.iter().map(|goal| Goal::parse(goal));
    let goals = goals.collect::<Result<Vec<Goal>>>()?;
    let rig = rig_file::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let read = |path| read_recording(path, arguments.quiet);
    let path = arguments.through.as_ref().map(read).transpose()?;
    let rate_hz = match arguments.rate {
        Some(rate) => rate,
        None => control_rate_hz(&arguments.rig)?.unwrap_or(Options::default().rate_hz),
    };
    let options = Options {
        rate_hz,
        seconds: arguments.seconds,
        effort: arguments.effort,
        seed: arguments.seed,
        simulations: arguments.simulations,
        knots: arguments.knots,
        tolerance: arguments.tolerance,
        ..Options::default()
    };
    let stage = Stage::begin("plan", arguments.quiet);
    let found = plan(
        &plant,
        &arguments.rig,
        &goals,
        path.as_ref(),
        &options,
        &mut |level| {
            stage.say(format!(
                "cost {} under the hard laws",
                significant(level.hard_cost, 3)
            ));
        },
    )?;
    stage.end(count(found.count.equivalent(), "simulation"));
    found.reached(arguments.tolerance)?;
    write(arguments, &rig.name, &plant, &found, &options)
}

/// Writes the recording, the page and the document, and says what is reached.
fn write(
    arguments: &Arguments,
    name: &str,
    plant: &Plant,
    found: &Plan,
    options: &Options,
) -> Result<()> {
    found
        .recording(plant, &arguments.out)?
        .write(&arguments.out)?;
    let said = Said::beside(
        [
            Some(arguments.out.as_path()),
            arguments.json.as_deref(),
            arguments.report.as_deref(),
        ],
        arguments.quiet,
    );
    if let Some(path) = &arguments.report {
        let plots = view::simulation(plant, &found.t, &found.inputs, &found.trajectory);
        let lead = sentences(found).join(" ");
        let page = view::page(name, lead, None, plots).made(&Provenance::typed());
        page.write(path)?;
    }
    for sentence in sentences(found) {
        said.line(sentence);
    }
    let rows = count(found.t.len(), "row");
    said.line(format!("{rows} in {}", arguments.out.display()));
    if let Some(path) = &arguments.report {
        said.wrote(path);
    }
    if let Some(path) = &arguments.json {
        let document = found.json(plant, options);
        sinew_files::write(path, format!("{document:#}\n"))?;
        said.wrote(path);
    }
    if !sinew_files::is_output(&arguments.out) {
        said.next(format!(
            "sinew record --port PORT --model DIR --input {} --out A.csv",
            arguments.out.display()
        ));
    }
    Ok(())
}

/// One sentence a goal, and one of the path.
fn sentences(found: &Plan) -> Vec<String> {
    let goals = found.outcomes.iter().map(|outcome| {
        let miss = significant((outcome.reached - outcome.goal.value).abs(), 3);
        let unit = match outcome.unit.as_str() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        format!(
            "{}: missed by {miss}{unit} under the hard laws.",
            outcome.goal
        )
    });
    let path = found.path_rms.map(|rms| {
        let part = significant(100.0 * rms, 3);
        format!("The path: missed by {part} % of its length (RMS) under the hard laws.")
    });
    goals.chain(path).collect()
}
