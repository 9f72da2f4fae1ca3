//! `sinew compare`: the predictive controller beside a tuned PID and a tuned RISE, on this computer.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use sinew_firmware::pid::PidState;
use sinew_firmware::rise::RiseState;

use super::{LoopArguments, overwrite};
use crate::compare::closed_loop::{Run, Score};
use crate::compare::disturbance::Disturbance;
use crate::compare::feedback::{Opponent, Tuning};
use crate::compare::results::{Entry, Results};
use crate::error::{Error, Result};
use crate::progress::Stage;
use crate::project::Board;
use crate::report::{Block, Report, Section, quantity};

/// Arguments of `sinew compare`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// What is added to the commands on their way to the plant; no controller is told of it.
    #[arg(long, value_enum, default_value = "none")]
    disturbance: Disturbance,
    /// Where the results are written for programs (sinew-comparison/1).
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Where a page with plots is written.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
}

/// # Errors
/// A bad file, a model that does not fit the rig, inputs and outputs that do not pair off.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let recordings = of_loop
        .recordings
        .fit
        .iter()
        .chain(&of_loop.recordings.test);
    overwrite::refuse(
        recordings
            .map(|path| ("a recording", path.as_path()))
            .chain([("RIG", of_loop.rig.as_path())]),
        [
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ],
    )?;
    let ready = of_loop.load()?;
    let mut bench = ready.bench(of_loop.common.seed);
    bench.disturbance = arguments.disturbance;
    let (values, moved) = bench.moved_plant();
    let scenario = bench.scenario(&values)?;
    let mpc = of_loop.run(&ready, &bench, Board::Host, &scenario)?;
    let stage = |name: &str| Stage::begin(format!("tune and run the {name}"), of_loop.common.quiet);
    let doing = stage("PID");
    let pid = bench.pid(&values, &scenario)?;
    doing.end("on the plant that it is judged on");
    let doing = stage("RISE");
    let rise = bench.opponent::<RiseState>(&values, &scenario)?;
    doing.end("on the plant that it is judged on");

    println!("reference: {}", ready.task.reference_source);
    for m in &moved {
        println!(
            "{:<32} {:>14} in the model, {:>14} in the plant",
            m.name,
            quantity(m.fitted, &m.unit),
            quantity(m.plant, &m.unit)
        );
    }
    let results = ready.results(vec![
        entry("MPC", &mpc.run, &mpc.score),
        entry("PID", &pid.run, &pid.score),
        entry("RISE", &rise.run, &rise.score),
    ]);
    print!("{}", results.text());
    if let Some(path) = &arguments.report {
        page(
            &results,
            &ready.task.reference_source,
            arguments.disturbance,
        )
        .write(path)?;
        println!("{}", path.display());
    }
    if let Some(path) = &arguments.json {
        let document = json!({
            "format": "sinew-comparison/1",
            "seed": of_loop.common.seed,
            "disturbance": arguments.disturbance,
            "reference": ready.task.reference_source,
            "plant": moved,
            "gains": { "PID": gains::<PidState>(&pid.tuning), "RISE": gains::<RiseState>(&rise.tuning) },
            "controllers": results.json(),
        });
        write_json(path, &document)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// One run under its name.
pub(super) fn entry<'a>(name: &str, run: &'a Run, score: &'a Score) -> Entry<'a> {
    Entry {
        name: name.into(),
        run,
        score,
    }
}

/// Gains by name, one object a channel.
pub(super) fn gains<L: Opponent>(tuning: &[Tuning<L::Gains>]) -> serde_json::Value {
    let channels = tuning.iter().map(|tuning| {
        let mut named: serde_json::Map<_, _> = L::named(&tuning.gains)
            .into_iter()
            .map(|(name, value)| (name.to_string(), json!(value)))
            .collect();
        named.insert("lead_steps".into(), json!(tuning.lead));
        serde_json::Value::from(named)
    });
    channels.collect()
}

/// Writes a document, whole or not at all.
pub(super) fn write_json(path: &Path, document: &serde_json::Value) -> Result<()> {
    let text = serde_json::to_string_pretty(document)
        .map_err(|e| Error::failed(format!("{}: {e}", path.display())))?;
    crate::atomic::write(path, text + "\n")
}

fn page(results: &Results<'_>, reference: &str, disturbance: Disturbance) -> Report {
    let load = match disturbance {
        Disturbance::None => "no disturbance".into(),
        other => format!(
            "a {} disturbance at the inputs",
            format!("{other:?}").to_lowercase()
        ),
    };
    let section = Section::new("The loop").with(Block::Table(results.table()));
    let plots = results.plots().into_iter().map(Block::Plot);
    Report::new("Controllers side by side")
        .lead(format!(
            "The same plant, limits and noise, {load}. Reference: {reference}."
        ))
        .section(plots.fold(section, Section::with))
        .footer(format!(
            "sinew compare · sinew {}",
            env!("CARGO_PKG_VERSION")
        ))
}
