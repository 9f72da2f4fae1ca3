//! Smallest error on the staircase: that of the best linear controller, which knows the
//! plant's own numbers, without friction and without limits (`tests/foreign/linear_bound.py` says
//! how). A target below it says nothing about a controller.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::bench::Bench;
use super::problems::MASS;
use super::published::{NOISE, excited};
use crate::foreign::python;
use xtask::process::{self, root};

/// As on the command line, and the folder of its results.
pub const NAME: &str = "mass-bound";
/// Command changes a period that the bound is printed for, N root mean square; the first row has
/// none.
const CHANGES: [&str; 5] = ["3", "2.5", "2", "1.5", "1"];

/// # Errors
/// Setup, Python or its packages, or the exit status of `sinew`.
pub fn run(seed: u64) -> Result<()> {
    let bench = Bench::new(NAME, seed)?;
    let rig = Path::new(MASS.nominal);
    // The seed of the mass's own first recording: what its noise is a part of.
    let inputs = bench.inputs(rig, &excited(&MASS), &(10 * seed).to_string())?;
    let recording = bench.path("fit.csv");
    let mut simulate = bench.sinew("simulate", rig);
    simulate.arg("--input").arg(inputs).arg("--out");
    process::run(simulate.arg(&recording).arg("--quiet"))?;
    let python = python::environment()?;
    let mut command = python.command(&["linear_bound.py"]);
    command.args([root().join(rig), root().join(recording)]);
    let bound = process::json(command.args([NOISE, MASS.delay]).args(CHANGES))?;
    let of = |value: &Value| value.as_f64().context("no number");
    println!(
        "noise {:.2} mm, load {} N",
        1e3 * of(&bound["noise"])?,
        bound["load"]
    );
    println!("\n| command change | RMS error | simulated |\n|--:|--:|--:|");
    let rows = bound["bounds"].as_array().context("no bounds")?;
    for (k, row) in rows.iter().enumerate() {
        let change = match k {
            0 => "any".into(),
            _ => format!("{:.2} N", of(&row["command_change"])?),
        };
        let [error, simulated] = [of(&row["rms"])?, of(&row["rms_simulated"])?].map(|e| 1e3 * e);
        println!("| {change} | {error:.2} mm | {simulated:.2} mm |");
    }
    let [least, most] = [of(&bound["drawn"][0])?, of(&bound["drawn"][1])?].map(|e| 1e3 * e);
    println!("\nany command, parameters 20 % off: {least:.2} to {most:.2} mm");
    bench.summary(json!({ "format": "sinew-experiment-bound/1", "bound": bound }))
}
