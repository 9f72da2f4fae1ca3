//! The Bouc-Wen benchmark with its published parameters, written by the foreign integrator: error
//! in metres on two tests without noise, beside the best published.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::foreign::python;
use xtask::process::{self, target_folder};

/// Best published free-run error on the benchmark's multisine test, m (a NARX-like model; see
/// docs/evaluation/proof-cases.md).
const BEST_PUBLISHED_M: f64 = 1.87e-5;

/// # Errors
/// No Python, the program does not build or fails on the case.
pub fn run() -> Result<()> {
    let folder = target_folder().join("proof/bouc-wen");
    if !folder.join("truth.json").exists() {
        let mut command = python::environment()?.command(&["-m", "hardlaw.bouc_wen"]);
        process::run(command.arg("--out").arg(&folder))?;
    }
    let sinew = process::program("sinew")?;
    for test in ["test-multisine", "test-sweep"] {
        let answer = folder.join(format!("{test}.json"));
        let mut command = Command::new(&sinew);
        command
            .args(["diagnose", "rig.toml", "--fit", "fit-a.csv"])
            .args(["--fit", "fit-b.csv", "--check", "check.csv"])
            .args(["--test", &format!("{test}.csv"), "--json"])
            .arg(&answer)
            .current_dir(&folder);
        process::run(&mut command)?;
        let said: Value = serde_json::from_str(&fs::read_to_string(&answer)?)
            .with_context(|| format!("{} is no answer", answer.display()))?;
        let errors = &said["fit"]["y_m"]["test"];
        println!("{test}: {}", said["sentence"].as_str().unwrap_or(""));
        println!(
            "  free-run error {} m before, {} m after; best published on the multisine test {BEST_PUBLISHED_M} m",
            errors["before_rms"], errors["after_rms"]
        );
        for effect in said["effects"].as_array().into_iter().flatten() {
            println!(
                "  {} at {}: {}",
                effect["kind"], effect["component"], effect["parameters"]
            );
        }
    }
    let truth = folder.join("truth.json");
    println!("true: {}", fs::read_to_string(&truth)?);
    Ok(())
}
