//! The control step on the reference problem: instructions along its closed loop in QEMU, cost over the optimum
//! by IPOPT, flash and RAM of the step alone (its image less the same image without it).

use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value, json};

use super::image;
use super::reference::{OUTPUTS, Plant, Reference, STEPS};
use crate::foreign::python;
use crate::process::{root, target_folder};
use crate::setup::{self, Extent};

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

/// Cycles an instruction and clocks for the estimate; the first from published timings of the mix.
const CYCLES_PER_INSTRUCTION: f64 = 1.7;
const CLOCKS_MHZ: [f64; 3] = [84.0, 100.0, 168.0];

/// What a run left.
struct Run {
    horizon: usize,
    blocks: Vec<u32>,
    instructions: Vec<u64>,
    tracking_rms: f64,
    stack: u64,
    log: PathBuf,
}

/// Counts, prints and returns `mpc_instructions`.
///
/// # Errors
/// An image does not build or run; there is no Python.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let python = python::environment()?;
    let mut section = Map::new();
    for case in CASES {
        let step = image::build(&toolchain, case.model, "count", false)?;
        let run = close(&step, case.name)?;
        let most = run.instructions.iter().max().copied().unwrap_or(0);
        let mean = run.instructions.iter().sum::<u64>() / run.instructions.len().max(1) as u64;
        let mut entry = json!({
            "mean": mean, "max": most, "tracking_rms": run.tracking_rms,
            "step_us_estimated": estimates(mean),
        });
        if case.judged {
            println!("IPOPT at {STEPS} steps, several starts each ...");
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
            let output = command.output().context("Python does not start")?;
            if !output.status.success() {
                bail!("{}", String::from_utf8_lossy(&output.stderr));
            }
            let judged: Map<String, Value> = serde_json::from_slice(&output.stdout)?;
            if let Some(entry) = entry.as_object_mut() {
                entry.extend(judged);
            }
        }
        println!("{}: {entry}", case.name);
        section.insert(case.name.into(), entry);
    }
    Ok(section.into())
}

/// Flash and RAM of the control step of S at N = 10, by subtraction, and of the counting image.
///
/// # Errors
/// As [`run`].
pub fn image() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let bytes = |empty| -> Result<(u64, u64)> {
        let elf = image::build(&toolchain, "reference-s", "count", empty)?;
        let (flash, ram) = image::sizes(&elf)?;
        let run = close(&elf, if empty { "empty" } else { "S_N10" })?;
        Ok((flash, ram + run.stack))
    };
    let (with, without) = (bytes(false)?, bytes(true)?);
    let section = json!({
        "flash_bytes": with.0 - without.0, "ram_bytes": with.1 - without.1,
        "whole_flash_bytes": with.0, "whole_ram_bytes": with.1,
    });
    println!("step alone, and with the counting program: {section}");
    Ok(section)
}

/// Microseconds by clock, from the mean: an estimate, no measurement.
fn estimates(instructions: u64) -> Value {
    let at = |mhz: f64| (instructions as f64 * CYCLES_PER_INSTRUCTION / mhz).round();
    let rows = CLOCKS_MHZ.map(|mhz| (format!("{mhz} MHz"), json!(at(mhz))));
    Map::from_iter(rows).into()
}

/// Closes the loop around an image; leaves every step in `target/bench/NAME.csv`.
fn close(elf: &Path, name: &str) -> Result<Run> {
    let reference = Reference::load().map_err(anyhow::Error::msg)?;
    let mut child = image::start(elf)?;
    let mut output = child.stdout.take().context("the child has an output")?;
    let mut input = child.stdin.take().context("the child has an input")?;
    let mut hear = |words: usize| -> Result<Vec<u32>> {
        let mut bytes = vec![0; 4 * words];
        output
            .read_exact(&mut bytes)
            .context("the image broke off")?;
        let words = bytes.chunks_exact(4);
        Ok(words
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    };
    let shapes = hear(5)?;
    let [n_u, _, n_s, horizon, n_blocks] =
        shapes.iter().map(|n| *n as usize).collect::<Vec<_>>()[..]
    else {
        bail!("the image's hello has another shape");
    };
    let blocks = hear(n_blocks)?;
    let mut plant = Plant::default();
    let (mut instructions, mut squares) = (Vec::new(), 0.0);
    let mut log = String::from("k,y1,y2,y3,u1,u2,plan\n");
    for k in 0..STEPS {
        let y = plant.outputs();
        for (y, r) in y.iter().zip(reference.at(k)) {
            squares += (y - f64::from(r)).powi(2);
        }
        let channels = if n_s > 0 { plant.channels(n_s) } else { vec![] };
        let rows = reference.preview(k, horizon);
        let measured = y.iter().chain(&channels).map(|y| *y as f32);
        for word in measured.clone().chain(rows.into_iter().flatten()) {
            input.write_all(&word.to_le_bytes())?;
        }
        input.flush()?;
        let answer = hear(4 + n_u + n_u * n_blocks)?;
        let (head, rest) = answer.split_at(4);
        instructions.push(image::instructions(head[0]));
        let numbers: Vec<f32> = rest.iter().map(|bits| f32::from_bits(*bits)).collect();
        let _ = write!(log, "{k}");
        for value in measured.take(OUTPUTS).chain(numbers.iter().copied()) {
            let _ = write!(log, ",{value:?}");
        }
        log.push('\n');
        plant.advance([f64::from(numbers[0]), f64::from(numbers[1])]);
    }
    drop(input);
    let stack = hear(1)?.first().copied().unwrap_or(0);
    child.wait()?;
    let path = target_folder().join(format!("bench/{name}.csv"));
    fs::write(&path, log)?;
    Ok(Run {
        horizon,
        blocks,
        instructions,
        tracking_rms: (squares / (STEPS * OUTPUTS) as f64).sqrt(),
        stack: stack.into(),
        log: path,
    })
}
