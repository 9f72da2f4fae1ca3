//! Control steps with a budget, beside those without, on the reference problem: instructions in
//! QEMU, the bound of the budget, and tracking of the plant.

use std::fs;

use anyhow::{Context, Result};
use serde_json::{Map, Value, json};
use sinew_model::emit::EmitOptions;
use sinew_model::spec::ModelSpec;
use sinew_model::{reference, regenerate, store, work};

use super::image::{self, Content};
use super::lockstep::{Run, close};
use xtask::process::{root, target_folder};
use xtask::setup::{self, Extent};

/// Budgets in percent of the longest step without one.
const SHARES: [u32; 4] = [100, 75, 50, 25];

/// Networks of `models/reference`.
const NETWORKS: [&str; 2] = ["S", "L"];

/// Counts, prints and returns `budget`.
///
/// # Errors
/// An image does not build or run.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let mut section = Map::new();
    println!("budget, mean, largest, steps stopped, tracking");
    for network in NETWORKS {
        let mut counted = |name: &str, budget: Option<u32>| -> Result<Run> {
            let spec = model(network, name, budget)?;
            let elf = image::build(&toolchain, &spec.name, "count", Content::Ours)?;
            let run = close(&elf, &spec.name)?;
            let (mean, most) = run.mean_and_most();
            println!(
                "{network} {name}: {budget:?}, {mean}, {most}, {}, {:.4}",
                run.stopped, run.tracking_rms
            );
            section.insert(
                format!("{network}_{name}"),
                json!({
                    "budget": budget, "mean": mean, "max": most, "stopped": run.stopped,
                    "tracking_rms": run.tracking_rms,
                }),
            );
            Ok(run)
        };
        let whole = counted("none", None)?;
        let (_, most) = whole.mean_and_most();
        for share in SHARES {
            let budget = u32::try_from(most * u64::from(share) / 100)?;
            counted(&share.to_string(), Some(budget))?;
        }
    }
    Ok(section.into())
}

/// The crate of a model with this budget in `target/bench/models`.
fn model(network: &str, name: &str, budget: Option<u32>) -> Result<ModelSpec> {
    let read = |file: &str| {
        let path = root().join("models/reference").join(file);
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))
    };
    let mut spec = reference::import(
        &read(&format!("{network}.json"))?,
        &read("problem.json")?,
        10,
        &[2, 2, 3, 3],
    )?;
    spec.name = format!("bench-{}-budget-{name}", network.to_lowercase());
    spec.control.budget = budget;
    let folder = target_folder().join("bench/models").join(&spec.name);
    store::save(&folder, &spec)?;
    let options = EmitOptions {
        firmware: root().join("firmware").display().to_string(),
        ..EmitOptions::default()
    };
    regenerate::write(&folder, &folder, &options)?;
    if let (None, "none") = (budget, name) {
        println!("{network}: a budget counts {:?}", work::parts(&spec));
    }
    Ok(spec)
}
