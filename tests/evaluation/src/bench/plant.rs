//! The simulator beside MuJoCo at equal accuracy, and what derivatives cost; both on one core, in
//! one run.

use anyhow::{Context, Result};
use serde_json::{Value, json};

use crate::foreign::python;
use xtask::process::{self, cargo, root};

/// Devices of `tests/foreign/trajectories` that both simulate.
const DEVICES: &[&str] = &["mass_spring_damper", "two_mass_drive", "tendon_finger"];
/// An error below this part of the range is as good as none: MuJoCo is not asked for more.
const ENOUGH: f64 = 1e-8;
/// Goal, in multiples of MuJoCo's speed.
const GOAL: f64 = 10.0;
/// 4,000 samples of the two-mass drive are to take less, ms.
const GOAL_MS: f64 = 1.0;

/// Measures, prints the table and returns the section.
///
/// # Errors
/// There is no Python, the simulator does not build, or a device cannot be simulated.
pub fn run() -> Result<Value> {
    let python = python::environment()?;
    println!("sinew-sim, 30 rounds a device ...");
    let mut ours = cargo(&["run", "--quiet", "--release", "--package", "sinew-sim"]);
    ours.args(["--example", "plant_speed", "--"]);
    ours.arg(root().join("tests/foreign/trajectories"))
        .args(DEVICES);
    let ours = process::json(&mut ours)?;

    println!("MuJoCo, every integrator at every step until it is as accurate ...");
    let mut theirs = python.command(&["mujoco_speed.py"]);
    for device in DEVICES {
        let error = number(&ours["devices"][device]["error"])?.max(ENOUGH);
        theirs.arg(format!("{device}={error:e}"));
    }
    let theirs = process::json(&mut theirs)?;

    let version = theirs["version"].as_str().unwrap_or("");
    println!(
        "\n| device | error | sinew-sim, s/s | MuJoCo {version}, s/s | its error | with | times |"
    );
    println!("|---|--:|--:|--:|--:|---|--:|");
    let mut rows = serde_json::Map::new();
    let mut all_reached = true;
    for device in DEVICES {
        let (mine, its) = (&ours["devices"][device], &theirs["devices"][device]);
        let speed = number(&mine["seconds_per_second"])?;
        // At no step as accurate as the simulator: its most accurate one then, which is a lower
        // bound.
        let reached = its["reached"] == true;
        let ratio = speed / number(&its["seconds_per_second"])?;
        println!(
            "| {device} | {:.1e} | {speed:.0} | {:.0} | {:.1e} | {}, {} s | {}{ratio:.1} |",
            number(&mine["error"])?,
            number(&its["seconds_per_second"])?,
            number(&its["error"])?,
            its["integrator"].as_str().unwrap_or(""),
            its["step_s"],
            if reached { "" } else { "more than " },
        );
        all_reached &= reached;
        rows.insert(
            (*device).into(),
            json!({"sinew_sim": mine, "mujoco": its, "ratio": ratio, "goal": GOAL}),
        );
    }
    if !all_reached {
        println!("\nmore than: MuJoCo is at no step that accurate; this is its most accurate one");
    }
    let milliseconds = number(&ours["two_mass_drive_4000_samples_ms"])?;
    println!("\n4,000 samples of the two-mass drive: {milliseconds:.3} ms (goal {GOAL_MS} ms)");
    println!("\n| derivatives | times a plain run | goal, 1 + p/2 |\n|--:|--:|--:|");
    let costs = ours["cost_with_derivatives"].as_object().context("costs")?;
    for (p, cost) in costs {
        let goal = 1.0 + 0.5 * p.parse::<f64>()?;
        println!("| {p} | {:.2} | {goal:.1} |", number(cost)?);
    }
    println!();
    Ok(json!({
        "devices": rows,
        "two_mass_drive_4000_samples_ms": milliseconds,
        "cost_with_derivatives": costs,
    }))
}

fn number(value: &Value) -> Result<f64> {
    value
        .as_f64()
        .with_context(|| format!("{value} is no number"))
}
