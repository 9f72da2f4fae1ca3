//! The control step on the reference problem: instructions along its closed loop in QEMU, cost over
//! the optimum by IPOPT, flash and RAM of the step alone (its image less the same image without
//! it).

use anyhow::{Result, bail};
use serde_json::{Map, Value, json};

use super::image::{self, Content};
use super::lockstep::{Run, close};
use super::reference::STEPS;
use crate::foreign::python::{self, Python};
use sinew_nn::footprint::CYCLES_PER_INSTRUCTION;
use xtask::process::{self, root};
use xtask::setup::{self, Extent};

/// A controller to count: its name in the summary, its model, the network of `models/reference`.
struct Case {
    name: &'static str,
    model: &'static str,
    network: &'static str,
    /// Held against IPOPT: minutes.
    judged: bool,
}

const CASES: &[Case] = &[
    Case {
        name: "S_N1",
        model: "reference-s-n1",
        network: "S",
        judged: false,
    },
    Case {
        name: "S_N5",
        model: "reference-s-n5",
        network: "S",
        judged: true,
    },
    Case {
        name: "S_N10",
        model: "reference-s",
        network: "S",
        judged: true,
    },
    Case {
        name: "P_N10",
        model: "reference-p",
        network: "P",
        judged: false,
    },
    Case {
        name: "L_N10",
        model: "reference-l",
        network: "L",
        judged: false,
    },
];

/// Clocks for the estimate.
const CLOCKS_MHZ: [f64; 3] = [84.0, 100.0, 168.0];

/// Counts, prints and returns `mpc_instructions`. Without a Python the costs over the optimum are
/// left out, and that is said.
///
/// # Errors
/// An image does not build or run, or IPOPT fails.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let python = python::of_the_bench().inspect_err(|error| {
        println!("NOT MEASURED: cost over the optimum, which needs IPOPT: {error:#}");
    });
    let mut section = Map::new();
    for case in CASES {
        let step = image::build(&toolchain, case.model, "count", Content::Ours)?;
        let run = close(&step, case.name)?;
        let (mean, most) = run.mean_and_most();
        let (flash, statics) = image::sizes(&step)?;
        let mut entry = Map::from_iter([
            ("mean".to_string(), json!(mean)),
            ("max".into(), json!(most)),
            ("stack_bytes".into(), json!(run.stack)),
            ("image_flash_bytes".into(), json!(flash)),
            ("image_static_bytes".into(), json!(statics)),
            ("tracking_rms".into(), json!(run.tracking_rms)),
            ("step_us_estimated".into(), estimates(most)),
        ]);
        if case.judged
            && let Ok(python) = &python
        {
            entry.extend(judge(python, case, &run)?);
        }
        println!("{}: {}", case.name, Value::from(entry.clone()));
        section.insert(case.name.into(), entry.into());
    }
    Ok(section.into())
}

/// IPOPT on the run: cost over the optimum, and IPOPT's own tracking.
fn judge(python: &Python, case: &Case, run: &Run) -> Result<Map<String, Value>> {
    println!("IPOPT at {STEPS} steps, several starts each, takes minutes ...");
    let reference = root().join("models/reference");
    let blocks: Vec<String> = run.blocks.iter().map(u32::to_string).collect();
    let mut command = python.command(&["ipopt_optimum.py"]);
    command
        .arg(&run.log)
        .arg(reference.join(case.network).with_extension("json"))
        .args([
            reference.join("problem.json"),
            reference.join("reference.csv"),
        ])
        .args([blocks.join(","), run.horizon.to_string()]);
    answer(command)
}

/// Output of a program of `tests/foreign`: one JSON object.
///
/// # Errors
/// As [`process::json`].
pub(super) fn answer(mut command: std::process::Command) -> Result<Map<String, Value>> {
    match process::json(&mut command)? {
        Value::Object(object) => Ok(object),
        other => bail!("{} printed {other}", process::line(&command)),
    }
}

/// Flash and RAM of the control step of S at N = 10, by subtraction, and of the counting image.
///
/// # Errors
/// As [`run`].
pub fn image() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let bytes = |content, name| -> Result<(u64, u64)> {
        let elf = image::build(&toolchain, "reference-s", "count", content)?;
        let (flash, ram) = image::sizes(&elf)?;
        Ok((flash, ram + close(&elf, name)?.stack))
    };
    let with = bytes(Content::Ours, "S_N10")?;
    let without = bytes(Content::Empty, "empty")?;
    let section = json!({
        "flash_bytes": with.0 - without.0, "ram_bytes": with.1 - without.1,
        "whole_flash_bytes": with.0, "whole_ram_bytes": with.1,
    });
    println!("step alone, and with the counting program: {section}");
    Ok(section)
}

/// Microseconds by clock: an estimate, no measurement (docs/evaluation/benchmarks.md says from
/// what).
fn estimates(instructions: u64) -> Value {
    let at = |mhz: f64| (instructions as f64 * CYCLES_PER_INSTRUCTION / mhz).round();
    let rows = CLOCKS_MHZ.map(|mhz| (format!("{mhz} MHz"), json!(at(mhz))));
    Map::from_iter(rows).into()
}
