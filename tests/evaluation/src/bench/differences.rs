//! Exact derivatives beside differences of predictions, in the same controller on the same problem:
//! what the derivatives of a generated network are worth.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::image::{self, Content};
use super::lockstep::close;
use crate::figure::dots;
use xtask::process::{root, target_folder};
use xtask::setup::{self, Extent};

/// The wrapper, as the tests have it.
const WRAPPER: &str = include_str!("../../../vectors/src/differenced.rs");
const MODEL: &str = "reference-s";
const DIFFERENCED: &str = "reference-s-differenced";

/// Counts, prints and returns `differences`.
///
/// # Errors
/// An image does not build or run.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    wrap(&target_folder().join("bench/models").join(DIFFERENCED))?;
    let mut section = json!({});
    let mut counts = Vec::new();
    for (name, model) in [("exact", MODEL), ("differences", DIFFERENCED)] {
        let elf = image::build(&toolchain, model, "count", Content::Ours)?;
        let run = close(&elf, name)?;
        let (mean, most) = run.mean_and_most();
        let (flash, _) = image::sizes(&elf)?;
        println!(
            "S at N = 10, {name}: {mean} instructions a step, {most} at most, tracking {:.4}, image {flash} B",
            run.tracking_rms
        );
        section[name] = json!({
            "mean": mean, "max": most, "tracking_rms": run.tracking_rms, "image_flash_bytes": flash,
            "stack_bytes": run.stack,
        });
        let steps = run.instructions.iter().map(|count| *count as f64);
        counts.push((name, steps.collect::<Vec<f64>>()));
    }
    let rows: Vec<(&str, &[f64])> = counts
        .iter()
        .map(|(name, steps)| (*name, steps.as_slice()))
        .collect();
    let figure = dots("Instructions of each control step", &rows, |count| {
        format!("{} k", count / 1e3)
    });
    let path = target_folder().join("bench/differences.svg");
    fs::write(&path, figure).with_context(|| format!("cannot write {}", path.display()))?;
    println!("{}", path.display());
    Ok(section)
}

/// The model's crate with its network in the wrapper.
fn wrap(folder: &Path) -> Result<()> {
    let ours = root().join("models").join(MODEL);
    let read = |file: &str| {
        let path = ours.join(file);
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))
    };
    let firmware = root().join("firmware").display().to_string();
    let manifest = read("Cargo.toml")?
        .replace(
            &format!("\"sinew-model-{MODEL}\""),
            &format!("\"sinew-model-{DIFFERENCED}\""),
        )
        .replace("../../firmware", &firmware);
    ensure!(
        manifest.contains(DIFFERENCED) && manifest.contains(&firmware),
        "the manifest of {MODEL} has another form"
    );
    let control = read("src/control.rs")?
        .replace("ControlLoop<Network,", "ControlLoop<Differenced<Network>,")
        .replace(
            "session::Session<\n    Network,",
            "session::Session<\n    Differenced<Network>,",
        )
        .replace(
            "ControlLoop::new(Network,",
            "ControlLoop::new(Differenced(Network),",
        )
        + "\nuse crate::differenced::Differenced;\n";
    ensure!(
        control.matches("Differenced").count() == 4,
        "the controller of {MODEL} has another form"
    );
    let library = read("src/lib.rs")? + "\nmod differenced;\n";
    let source = folder.join("src");
    fs::create_dir_all(&source).with_context(|| format!("cannot make {}", source.display()))?;
    for (file, text) in [
        ("Cargo.toml", manifest),
        ("src/control.rs", control),
        ("src/lib.rs", library),
        ("src/network.rs", read("src/network.rs")?),
        ("src/golden.rs", read("src/golden.rs")?),
        ("src/differenced.rs", WRAPPER.to_string()),
    ] {
        let path = folder.join(file);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
