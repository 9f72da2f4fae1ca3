//! `sinew compare`: predictive controllers beside a tuned PID, on one plant.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::RangedU64ValueParser;

use super::{LoopArguments, overwrite};
use crate::chain::contest::{Contest, Contestant};
use crate::error::{Error, Result};
use crate::progress::Stage;
use crate::project::Board;
use crate::report::{Table, quantity, sheet};

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
    let ready = of_loop.load(arguments.plant.as_deref())?;
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
        controllers.push(Contestant::mpc(name, loops, on_board.as_deref())?);
    }
    let stage = Stage::begin("tune and run the PID", of_loop.common.quiet);
    match bench.tuned_pid(&ready.values) {
        Ok(tuning) => {
            let loops = scenarios.iter().map(|scenario| {
                let run = scenario.run(&mut bench.pid_with(&tuning))?;
                Ok((run.score(&ready.task.limits), run))
            });
            controllers.push(Contestant::pid(loops.collect::<Result<_>>()?)?);
            stage.end("on the plant that it is judged on");
        }
        // Inputs and outputs that do not pair off are no reason to withhold the others.
        Err(reason) => stage.end(format!("none: {reason}")),
    }

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
    let contest = Contest::new(&ready, &of_loop.rig, plant, board, controllers);
    print(&contest.table());
    if let Some(path) = &arguments.json {
        crate::atomic::write(path, contest.json()?)?;
        println!("{}", path.display());
    }
    if let Some(path) = &arguments.report {
        let command = format!("sinew compare {}", of_loop.rig.display());
        contest.report(&command).write(path)?;
        println!("{}", path.display());
    }
    if let Some(path) = &arguments.plot {
        crate::atomic::write(path, sheet(&contest.plots()))?;
        println!("{}", path.display());
    }
    Ok(())
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
        if name.is_empty() || name == "PID" || names.contains(&name) {
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

fn print(table: &Table) {
    let titles = table.columns.iter().map(|column| column.title.clone());
    let titles: Vec<String> = titles.collect();
    let rows = || std::iter::once(&titles).chain(&table.rows);
    let width = |i: usize| rows().map(|row| row[i].chars().count()).max();
    let widths: Vec<usize> = (0..titles.len()).filter_map(width).collect();
    println!("{}", table.caption);
    for row in rows() {
        let cells = row.iter().zip(&widths).zip(&table.columns);
        let cells = cells.map(|((cell, width), column)| match column.numeric {
            true => format!("{cell:>width$}"),
            false => format!("{cell:<width$}"),
        });
        println!("{}", cells.collect::<Vec<_>>().join("  "));
    }
}
