//! What a part of the controller is worth, a figure each: the published problems with it and without it, on the same plants.
//!
//! Exact derivatives have a benchmark (`cargo xtask bench differences`), mended physics an experiment of its own.

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::bench::Bench;
use super::problems::{HASEL, MASS, TENDON};
use super::published::{self, Problem};
use crate::figure::{Row, loops};

/// As on the command line, and the folder of its results.
pub const NAME: &str = "ablations";

/// What the problems are called in figures.
const PROBLEMS: [(&str, &Problem); 3] = [("mass", &MASS), ("tendon", &TENDON), ("HASEL", &HASEL)];

/// Something that a controller can be without.
struct Ablation {
    /// Its figure is called so.
    name: &'static str,
    title: &'static str,
    /// The controllers without it.
    variant: &'static str,
    /// What the rows with and without it are called.
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

/// # Errors
/// Those of the problems' own experiments.
pub fn run(seed: u64) -> Result<()> {
    let mut found = Vec::new();
    for (label, problem) in PROBLEMS {
        let whole = problem.variants.first().context("no controller")?.name;
        let names = [whole].into_iter().chain(ABLATIONS.map(|a| a.variant));
        let names: Vec<String> = names.map(String::from).collect();
        found.push((label, whole, published::run(problem, seed, &names)?));
    }
    let bench = Bench::new(NAME, seed)?;
    for ablation in &ABLATIONS {
        let mut rows = Vec::new();
        for (label, whole, comparison) in &found {
            for (variant, name) in [*whole, ablation.variant].iter().zip(ablation.rows) {
                let name = format!("{label}, {name}");
                rows.push(Row {
                    name,
                    ..Row::of(controller(comparison, variant)?)?
                });
            }
        }
        let file = format!("{}.svg", ablation.name);
        bench.write(&file, &loops(ablation.title, &rows))?;
    }
    let comparisons = found.iter().map(|(label, _, comparison)| {
        json!({ "problem": label, "controllers": comparison["controllers"] })
    });
    let comparisons: Vec<Value> = comparisons.collect();
    bench.summary(json!({ "format": "sinew-experiment-ablations/1", "problems": comparisons }))
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
