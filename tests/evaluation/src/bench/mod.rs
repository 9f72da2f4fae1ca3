//! `cargo xtask bench [SECTION...]`: what is measured, as tables and in
//! `target/bench/summary.json`. `--publish` also writes the controller's table into
//! `docs/evaluation/benchmarks.md`.

mod budget;
mod control;
mod diagnosis;
mod differences;
mod fit;
mod forward;
pub mod image;
mod lockstep;
mod parts;
mod peers;
pub mod plant;
/// The reference problem's plant and reference, as the tests have them.
#[path = "../../../src/reference.rs"]
#[allow(dead_code, reason = "the tests use what is not used here")]
mod reference;
mod table;
mod value;

use std::fs;

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value};

use xtask::process::{root, target_folder};

/// A section: its name and what measures it.
type Section = (&'static str, fn() -> Result<Value>);

/// Adding one is a line here.
const SECTIONS: &[Section] = &[
    ("forward_instructions", forward::run),
    ("mpc_instructions", control::run),
    ("terminal_value", value::run),
    ("budget", budget::run),
    ("image", control::image),
    ("differences", differences::run),
    ("parts", parts::run),
    ("peers", peers::run),
    ("plant", plant::run),
    ("diagnosis", diagnosis::run),
    ("fit", fit::run),
];

/// # Errors
/// There is no such section, or one failed; what was measured before is written all the same.
pub fn run(arguments: &[String]) -> Result<()> {
    let (publish, wanted): (Vec<&String>, Vec<&String>) = arguments
        .iter()
        .partition(|argument| *argument == "--publish");
    let known = |name: &str| SECTIONS.iter().any(|(section, _)| *section == name);
    if let Some(unknown) = wanted.iter().find(|name| !known(name)) {
        let names: Vec<&str> = SECTIONS.iter().map(|(name, _)| *name).collect();
        bail!(
            "there is no section '{unknown}'; there are {}",
            names.join(", ")
        );
    }
    let mut summary = Map::new();
    for (name, measure) in SECTIONS {
        if wanted.is_empty() || wanted.iter().any(|wanted| wanted == name) {
            let section = measure().with_context(|| format!("bench section '{name}'"))?;
            summary = keep(name, section)?;
        }
    }
    let Some(table) = table::of_the_controller(&summary) else {
        return Ok(());
    };
    println!("\n{table}");
    if !publish.is_empty() {
        let path = root().join("docs/evaluation/benchmarks.md");
        fs::write(&path, table).with_context(|| format!("cannot write {}", path.display()))?;
        println!("wrote {}", path.display());
    }
    Ok(())
}

/// Writes one section into the summary and leaves the others as they are; the whole of it.
fn keep(name: &str, section: Value) -> Result<Map<String, Value>> {
    let path = target_folder().join("bench/summary.json");
    let mut summary: Map<String, Value> = match fs::read_to_string(&path) {
        Ok(text) => serde_json::from_str(&text)
            .with_context(|| format!("{} is no JSON object: delete it", path.display()))?,
        Err(_) => Map::new(),
    };
    summary.insert("format".into(), "sinew-bench/1".into());
    summary.insert(name.into(), section);
    fs::create_dir_all(path.parent().context("the summary has a folder")?)?;
    let text = serde_json::to_string_pretty(&summary)? + "\n";
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    println!("wrote {}", path.display());
    Ok(summary)
}
