//! Time and memory of `sinew diagnose` by length of recording, on a rig of two bodies whose real
//! one rubs.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use xtask::process::{self, root, target_folder};

const RIG: &str = "rigs/two-mass-drive.toml";
/// Effect that the real one has and the rig has not.
const HIDDEN: &str = "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"load\"\nlevel = { value = 0.05, min = 0.0 }\n";
/// Samples of each recording, and what is to be kept: seconds on two cores, or megabytes.
const LENGTHS: &[(usize, Option<f64>, Option<f64>)] =
    &[(4_000, Some(5.0), None), (200_000, None, Some(500.0))];
/// Rows a second of `sinew excite` where the rig names no rate.
const RATE: f64 = 120.0;

/// Measures, prints the table and returns the section.
///
/// # Errors
/// The program does not build or fails, or finds something else.
pub fn run() -> Result<Value> {
    process::program("sinew")?;
    let folder = target_folder().join("bench/diagnosis");
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let nominal = fs::read_to_string(root().join(RIG)).with_context(|| format!("no {RIG}"))?;
    fs::write(folder.join("real.toml"), nominal.clone() + HIDDEN)?;
    fs::write(folder.join("nominal.toml"), nominal)?;
    println!(
        "| samples of each of three recordings | seconds | wanted | largest memory, MB | wanted |"
    );
    println!("|--:|--:|--:|--:|--:|");
    let mut section = Vec::new();
    for &(samples, most_s, most_mb) in LENGTHS {
        let seconds = samples as f64 / RATE;
        for (seed, role) in (1..).zip(["fit", "check", "test"]) {
            record(&folder, role, seconds, seed)?;
        }
        let (took, megabytes) = diagnose(&folder)?;
        let wanted = |goal: Option<f64>, unit| goal.map_or("-".into(), |g| format!("{g} {unit}"));
        println!(
            "| {samples} | {took:.1} | {} | {megabytes:.0} | {} |",
            wanted(most_s, "s"),
            wanted(most_mb, "MB")
        );
        section.push(json!({ "samples": samples, "seconds": took, "megabytes": megabytes }));
    }
    Ok(section.into())
}

fn sinew(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(target_folder().join("debug/sinew"));
    command.args(line.split_whitespace()).current_dir(folder);
    command
}

fn record(folder: &Path, role: &str, seconds: f64, seed: u64) -> Result<()> {
    let excite =
        format!("excite nominal.toml --out inputs.csv --seconds {seconds} --kind mixed --no-table");
    let simulate = format!(
        "simulate real.toml --input inputs.csv --out {role}.csv --with-inputs --noise 0.002"
    );
    for line in [excite, simulate] {
        process::run(&mut sinew(folder, &format!("{line} --quiet --seed {seed}")))?;
    }
    Ok(())
}

/// Seconds, and the most memory that the process ever had.
fn diagnose(folder: &Path) -> Result<(f64, f64)> {
    let begun = Instant::now();
    let line = "diagnose nominal.toml --fit fit.csv --check check.csv --test test.csv --json found.json --quiet";
    let mut child = sinew(folder, line).spawn().context("it does not start")?;
    let status = format!("/proc/{}/status", child.id());
    let mut kilobytes = 0.0_f64;
    let ended = loop {
        // Gone at the end, and not there on a system without /proc.
        let now = fs::read_to_string(&status).unwrap_or_default();
        let peak = now.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let peak = peak.and_then(|rest| rest.split_whitespace().next()?.parse().ok());
        kilobytes = kilobytes.max(peak.unwrap_or(0.0));
        if let Some(ended) = child.try_wait()? {
            break ended;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let seconds = begun.elapsed().as_secs_f64();
    ensure!(ended.success(), "sinew diagnose failed");
    let found: Value = serde_json::from_str(&fs::read_to_string(folder.join("found.json"))?)?;
    ensure!(
        found["effects"][0]["kind"] == "coulomb_friction"
            && found["effects"][0]["component"] == "load",
        "it found something else: {}",
        found["sentence"]
    );
    ensure!(
        kilobytes > 0.0,
        "this system does not say how much memory a process has"
    );
    Ok((seconds, kilobytes / 1024.0))
}
