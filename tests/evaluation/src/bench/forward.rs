//! Instructions of one prediction of each network of the reference problem, largest over its golden
//! vectors.

use std::io::Read;

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Map, Value, json};

use super::image::{self, Content};
use xtask::setup::{self, Extent};

/// Name in the summary, and the model.
pub(super) const NETWORKS: &[(&str, &str)] = &[
    ("S", "reference-s"),
    ("L", "reference-l"),
    ("P", "reference-p"),
];

/// Counts, prints and returns the section.
///
/// # Errors
/// An image does not build or run.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let mut section = Map::new();
    for (name, model) in NETWORKS {
        let largest = count(&image::build(&toolchain, model, "forward", Content::Ours)?)?;
        println!("forward {name}: {largest} instructions");
        section.insert((*name).into(), json!(largest));
    }
    Ok(section.into())
}

/// Runs an image of the program `forward`: the largest number of instructions of a prediction.
///
/// # Errors
/// QEMU does not start, or the image breaks off.
pub(super) fn count(elf: &Path) -> Result<u64> {
    let mut child = image::start(elf)?;
    let mut bytes = Vec::new();
    let output = child.stdout.as_mut().context("the child has an output")?;
    output.read_to_end(&mut bytes)?;
    child.wait()?;
    let words = bytes
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let words: Vec<u32> = words.collect();
    let (count, ticks) = words.split_first().context("the image said nothing")?;
    let (empty, ticks) = ticks.split_last().context("the image broke off")?;
    anyhow::ensure!(
        ticks.len() == *count as usize && *count > 0,
        "the image broke off"
    );
    let counts = ticks.iter().map(|t| image::instructions(*t - *empty));
    Ok(counts.max().unwrap_or(0))
}
