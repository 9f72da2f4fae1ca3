//! `cargo xtask cycles`: no file of a crate depends, through others, on itself; no crate on what it
//! must not know; no file outside `cli` on the command line.

mod file;
mod graph;
mod ring;
mod rooms;
mod rules;
pub mod tokens;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde_json::Value;
use xtask::process::{self, cargo, root};

use graph::Graph;

/// # Errors
/// A ring of files, each of its edges by file and line; a crate that depends on what it must not
/// know; or a flag of the command line outside `cli`.
pub fn check() -> Result<()> {
    let mut wrong = rules::broken()?;
    let mut files = 0;
    for (name, top) in targets()? {
        let graph = Graph::of_crate(&top, &disk)?;
        files += graph.files.len();
        wrong.extend(rooms::flags_outside_cli(&graph, &disk));
        for ring in ring::rings(&graph) {
            wrong.push(format!(
                "{name}: {}",
                ring::description(&graph, &ring, &root())
            ));
        }
    }
    if wrong.is_empty() {
        println!("{files} files, no ring of files, no rule between crates broken");
        return Ok(());
    }
    bail!("{}\n{} in all", wrong.join("\n"), wrong.len())
}

fn disk(path: &std::path::Path) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

/// The top file of every library and program of the workspace, by the name of its package.
fn targets() -> Result<Vec<(String, PathBuf)>> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let metadata = process::json(&mut cargo(&arguments))?;
    let mut found = BTreeMap::new();
    for package in array(&metadata, "packages")? {
        let name = package["name"].as_str().context("a package has a name")?;
        for target in array(package, "targets")? {
            let kind = target["kind"][0].as_str().unwrap_or_default();
            let top = target["src_path"].as_str().context("a target has a file")?;
            if matches!(kind, "lib" | "bin" | "cdylib" | "proc-macro") {
                found.insert((name.to_string(), PathBuf::from(top)), ());
            }
        }
    }
    Ok(found.into_keys().collect())
}

fn array<'a>(value: &'a Value, key: &str) -> Result<&'a Vec<Value>> {
    value[key]
        .as_array()
        .with_context(|| format!("cargo metadata has no list of {key}"))
}
