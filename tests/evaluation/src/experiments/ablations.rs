//! Value of each part of the controller, a figure each: the published problems with it and
//! without it, on the same plants.
//!
//! Exact derivatives have a benchmark (`cargo xtask bench differences`), corrected physics an
//! experiment of its own.

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::bench::Bench;
use super::problem::Problem;
use super::problems::{HASEL, MASS, TENDON};
use super::published;
use crate::figure::{Row, loops};

/// As on the command line, and the folder of its results.
pub const NAME: &str = "ablations";

/// Names of the problems in figures.
const PROBLEMS: [(&str, &Problem); 3] = [("mass", &MASS), ("tendon", &TENDON), ("HASEL", &HASEL)];

/// Something that a controller can be without.
struct Ablation {
    /// Its figure is called so.
    name: &'static str,
    title: &'static str,
    /// The controllers without it.
    variant: &'static str,
    /// Names of the rows with and without it.
    rows: [&'static str; 2],
}

const ABLATIONS: [Ablation; 2] = [
    Ablation {
        name: "horizon",
        title: "RMS error of each of the ten loops: what a horizon is worth",
        variant: "horizon-1",
        rows: ["its horizon", "horizon 1"],
    },
    Ablation {
        name: "estimate",
        title: "RMS error of each of the ten loops: what the estimate of the disturbance is worth",
        variant: "no-estimate",
        rows: ["estimate", "no estimate"],
    },
];

/// Of what the problems' own experiments have left; those that have not been run with this seed are
/// run first.
///
/// # Errors
/// Those of the problems' experiments.
pub fn run(seed: u64) -> Result<()> {
    let found = PROBLEMS.map(|(label, problem)| Ok((label, problem, left(problem, seed)?)));
    let found: Vec<(&str, &Problem, Value)> = found.into_iter().collect::<Result<_>>()?;
    let bench = Bench::new(NAME, seed)?;
    for ablation in &ABLATIONS {
        let mut rows = Vec::new();
        for (label, problem, comparison) in &found {
            let whole = problem.variants.first().context("no controller")?.name;
            for (variant, name) in [whole, ablation.variant].iter().zip(ablation.rows) {
                let name = format!("{label}, {name}");
                let row = Row::of(controller(comparison, variant)?)?;
                rows.push(Row { name, ..row });
            }
        }
        let file = format!("{}.svg", ablation.name);
        bench.write(&file, &loops(ablation.title, &rows))?;
    }
    let of = PROBLEMS.map(|(_, problem)| format!("{}/summary.json", problem.name));
    bench.summary(json!({ "format": "sinew-experiment-ablations/1", "seed": seed, "of": of }))
}

/// The comparison of a problem with this seed.
fn left(problem: &Problem, seed: u64) -> Result<Value> {
    let bench = Bench::new(problem.name, seed)?;
    let summary = || bench.json("summary.json");
    let mut whole = match summary() {
        Ok(whole) if whole["seed"] == seed => whole,
        _ => {
            published::run(problem, seed, &[])?;
            summary()?
        }
    };
    println!("from {}", bench.path("summary.json").display());
    Ok(whole["comparison"].take())
}

fn controller<'a>(comparison: &'a Value, name: &str) -> Result<&'a Value> {
    let all = comparison["controllers"].as_array();
    let named = all.and_then(|all| all.iter().find(|c| c["name"] == name));
    named.with_context(|| format!("a comparison without '{name}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_problem_has_the_controllers_that_an_ablation_names() {
        for (label, problem) in PROBLEMS {
            for ablation in &ABLATIONS {
                let there = problem.variants.iter().any(|v| v.name == ablation.variant);
                assert!(there, "{label}: {}", ablation.variant);
            }
        }
    }
}
