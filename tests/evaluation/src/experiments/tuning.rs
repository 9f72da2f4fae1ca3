//! `cargo xtask experiments tuning`: the MPC of three published problems, tuned by a simplex and by
//! derivatives of its loop, and judged on plants that neither has seen.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use super::bench::Bench;
use super::problem::Problem;
use super::problems::{HASEL, MASS, TENDON};
use super::published::Run;
use crate::figure::{Row, middle, millimetres};
use xtask::process;

/// Its name on the command line.
pub const NAME: &str = "tuning";

/// A problem and the horizons of its first controller.
const CASES: [(&Problem, [&str; 2]); 3] = [
    (&MASS, ["12", "4"]),
    (&TENDON, ["10", "3"]),
    (&HASEL, ["10", "2"]),
];

/// Ways to tune: a name, and what `sinew tune` is told.
const WAYS: [(&str, &[&str]); 4] = [
    ("simplex-120", &["--by", "simplex", "--evaluations", "120"]),
    ("simplex-480", &["--by", "simplex", "--evaluations", "480"]),
    ("gradient", &["--by", "gradient", "--evaluations", "25"]),
    (
        "gradient-12",
        &["--by", "gradient", "--evaluations", "25", "--plants", "12"],
    ),
];

/// Tunes, compares and prints, for a seed; with names in `only`, those problems alone.
///
/// # Errors
/// A problem that there is not, setup, or the exit status of `sinew`.
pub fn run(seed: u64, only: &[String]) -> Result<()> {
    if let Some(name) = only
        .iter()
        .find(|name| CASES.iter().all(|(p, _)| p.name != **name))
    {
        let known: Vec<&str> = CASES.iter().map(|(problem, _)| problem.name).collect();
        bail!(
            "{NAME} has no case '{name}'; there are {}",
            known.join(", ")
        );
    }
    let wanted = |problem: &Problem| only.is_empty() || only.iter().any(|n| n == problem.name);
    let mut lines = vec![TITLES.to_string(), RULE.to_string()];
    for (problem, shape) in CASES.iter().filter(|(problem, _)| wanted(problem)) {
        lines.extend(case(problem, shape, seed)?);
        println!("{}", lines.join("\n"));
    }
    Ok(())
}

const TITLES: &str = "| problem | by | evaluations | objective, its tuning plants | time | \
                      RMS error: median, worst | largest error: median, worst |";
const RULE: &str = "|---|---|--:|--:|--:|---|---|";

/// Rows of one problem.
fn case(problem: &Problem, shape: &[&str; 2], seed: u64) -> Result<Vec<String>> {
    let variant = problem.variants.first().context("no controller")?;
    let run = Run {
        bench: Bench::new(&format!("{NAME}/{}", problem.name), seed)?,
        problem,
        variants: vec![variant],
        part: "",
    };
    run.prepare()?;
    let (rig, model) = run.trained(variant)?;
    let mut tuned: Vec<(Value, f64)> = Vec::new();
    let mut models: Vec<PathBuf> = Vec::new();
    for (name, arguments) in WAYS {
        let mut tune = run.tuning(&rig, &model);
        tune.args(["--disturbance", problem.disturbance]);
        tune.args(["--horizons", shape[0], "--control-horizons", shape[1]]);
        tune.args(arguments);
        let path = |ending: &str| run.bench.path(&format!("{name}.{ending}"));
        tune.arg("--out").arg(path("toml"));
        tune.arg("--json").arg(path("json"));
        models.push(run.bench.path("models").join(name));
        tune.arg("--model-out").args(models.last());
        let begun = Instant::now();
        process::run(&mut tune)?;
        let seconds = begun.elapsed().as_secs_f64();
        tuned.push((run.bench.json(&format!("{name}.json"))?, seconds));
    }
    let mut compare = run.loops_of(&rig, &models);
    compare.args(["--evaluations", "20", "--board", "host", "--out"]);
    compare.arg(run.bench.path("firmware"));
    process::run(compare.arg("--json").arg(run.bench.path("comparison.json")))?;
    let comparison = run.bench.json("comparison.json")?;
    let controllers = comparison["controllers"].as_array().context("no loops")?;
    let mut lines = Vec::new();
    let mut rows = Vec::new();
    for ((name, _), (result, seconds)) in WAYS.iter().zip(&tuned) {
        let of = |controller: &&Value| controller["name"] == *name;
        let row = Row::of(controllers.iter().find(of).context("no loops of it")?)?;
        let pair = |values: &[f64]| {
            let (median, worst) = middle(values);
            format!("{}, {}", millimetres(median), millimetres(worst))
        };
        let objective = &result["objectives"][0];
        let number = |value: &Value| value.as_f64().context("no figure");
        lines.push(format!(
            "| {} | {name} | {} | {:.3e} | {seconds:.0} s | {} | {} |",
            problem.name,
            objective["evaluations"],
            number(&objective["training"]["after"])?,
            pair(&row.rms),
            pair(&row.max),
        ));
        rows.push(json!({
            "by": name,
            "evaluations": objective["evaluations"],
            "objective": objective["training"]["after"],
            "seconds": seconds,
            "rms": row.rms,
            "max": row.max,
        }));
    }
    run.bench.summary(json!({
        "format": "sinew-experiment-tuning/1",
        "seed": seed,
        "ways": rows,
    }))?;
    Ok(lines)
}
