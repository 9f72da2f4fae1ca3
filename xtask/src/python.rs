//! `cargo xtask python`: the Python package, built and tested in an environment of its own.
//!
//! The first run fetches packages for the tests; later ones compile and test only. Without Python,
//! `venv`, pip or a package index it says so in capitals and counts as done: the workspace needs no
//! Python.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::arguments::none;
use xtask::process::{self, cargo, root, succeeds, target_folder};

/// Packages of the tests, and the one that builds the extension.
const PACKAGES: &[&str] = &[
    "maturin>=1.7,<2",
    "numpy>=1.23",
    "pandas>=2",
    "matplotlib>=3.6",
    "pytest>=7",
    "mujoco>=3",
    "nbclient>=0.8",
    "ipykernel>=6",
];

/// Builds the package and runs its tests.
///
/// # Errors
/// A lint, a compiler error or a failing test.
pub fn run(arguments: &[String]) -> Result<()> {
    none(arguments)?;
    let manifest = root().join("host/python/Cargo.toml");
    let mut format = cargo(&["fmt", "--check", "--manifest-path"]);
    process::run(format.arg(&manifest))?;
    let Some(environment) = environment("python-environment", PACKAGES)? else {
        println!("SKIPPED: the Python package is not tested");
        return Ok(());
    };
    let program = |name: &str| {
        let mut command = Command::new(environment.join("bin").join(name));
        command.env("VIRTUAL_ENV", &environment);
        command.env("CARGO_TARGET_DIR", target_folder());
        command.current_dir(root().join("host/python"));
        command
    };
    process::run(process::linted(&mut program("maturin")).args(["develop", "--quiet"]))?;
    process::run(program("python").args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]))
}

/// A virtual environment of this name in the target folder, with packages; none where it cannot be
/// had.
///
/// # Errors
/// The record of its packages cannot be written.
pub fn environment(name: &str, packages: &[&str]) -> Result<Option<PathBuf>> {
    let folder = target_folder().join(name);
    let record = folder.join("packages.txt");
    let wanted = packages.join("\n");
    if fs::read_to_string(&record).is_ok_and(|installed| installed == wanted) {
        return Ok(Some(folder));
    }
    let made = succeeds(Command::new("python3").args(["-m", "venv"]).arg(&folder));
    if !made {
        println!("python3 with the modules venv and ensurepip is not there");
        return Ok(None);
    }
    println!("installing {} for the tests", packages.join(", "));
    let mut pip = Command::new(Path::new(&folder).join("bin/pip"));
    pip.args(["install", "--quiet", "--disable-pip-version-check"]);
    if !succeeds(pip.args(packages)) {
        println!("pip cannot install the packages of the tests");
        return Ok(None);
    }
    fs::write(&record, wanted).with_context(|| format!("cannot write {}", record.display()))?;
    Ok(Some(folder))
}
