//! Other people's code for the same shapes, printed, compiled and counted in the same way: emlearn
//! for the prediction, an embedded OSQP on the linearised problem for the step
//! (`tests/foreign/peers.py`).

use std::path::PathBuf;

use anyhow::Result;
use serde_json::{Map, Value, json};

use super::control::answer;
use super::image::{self, Content};
use super::{forward, lockstep};
use crate::foreign::python::{self, Python};
use xtask::process::{root, target_folder};
use xtask::setup::{self, Extent};

/// Name in the summary, model with the shapes, horizon.
const STEPS: &[(&str, &str, u8)] = &[("S_N5", "reference-s-n5", 5), ("S_N10", "reference-s", 10)];

/// Counts, prints and returns the section; empty where there is no Python, and that is said.
///
/// # Errors
/// A peer does not build or run.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let python = match python::of_the_bench() {
        Ok(python) => python,
        Err(error) => {
            println!("NOT MEASURED: other people's code: {error:#}");
            return Ok(Map::new().into());
        }
    };
    let (mut predictions, mut steps) = (Map::new(), Map::new());
    for (name, model) in forward::NETWORKS {
        let (archive, mut entry) = print(&python, "emlearn", name, &[])?;
        let content = Content::Peer(&archive);
        let elf = image::build(&toolchain, model, "forward", content)?;
        entry.insert("instructions".into(), json!(forward::count(&elf)?));
        println!("forward {name}: {}", Value::from(entry.clone()));
        predictions.insert((*name).into(), entry.into());
    }
    for (name, model, horizon) in STEPS {
        let problem = root().join("models/reference/problem.json");
        let arguments = [problem.display().to_string(), horizon.to_string()];
        let (archive, mut entry) = print(&python, "osqp", "S", &arguments)?;
        let elf = image::build(&toolchain, model, "count", Content::Peer(&archive))?;
        let empty = image::build(&toolchain, model, "count", Content::Empty)?;
        let run = lockstep::close(&elf, &format!("peer-{name}"))?;
        let without = lockstep::close(&empty, "empty")?;
        let (flash, ram) = image::sizes(&elf)?;
        let (flash_without, ram_without) = image::sizes(&empty)?;
        let (mean, most) = run.mean_and_most();
        entry.extend([
            ("mean".to_string(), json!(mean)),
            ("max".into(), json!(most)),
            ("tracking_rms".into(), json!(run.tracking_rms)),
            ("flash_bytes".into(), json!(flash - flash_without)),
            (
                "ram_bytes".into(),
                json!(ram + run.stack - ram_without - without.stack),
            ),
        ]);
        println!("step {name}: {}", Value::from(entry.clone()));
        steps.insert((*name).into(), entry.into());
    }
    Ok(json!({ "forward": predictions, "mpc": steps }))
}

/// Lets a peer print and compile its code; the archive, and what it says of itself.
fn print(
    python: &Python,
    peer: &str,
    network: &str,
    arguments: &[String],
) -> Result<(PathBuf, Map<String, Value>)> {
    let weights = root().join("models/reference").join(network);
    let mut folder = format!("bench/peers/{peer}-{network}");
    if let [.., horizon] = arguments {
        folder.push_str(&format!("-{horizon}"));
    }
    let folder = target_folder().join(folder);
    let mut command = python.command(&["peers.py", peer]);
    command
        .arg(weights.with_extension("json"))
        .args(arguments)
        .arg(&folder);
    Ok((folder.join("libpeer.a"), answer(command)?))
}
