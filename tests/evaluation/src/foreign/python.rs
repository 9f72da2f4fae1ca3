//! Python environments of their own under `target/`, with the packages that a file of
//! `tests/foreign` lists.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use xtask::process::{self, root, target_folder};

/// An environment that has every package.
pub struct Python {
    program: PathBuf,
}

impl Python {
    /// A call with `tests/foreign` as its folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        command
            .args(arguments)
            .current_dir(root().join("tests/foreign"));
        command
    }

    /// The line for `sh` that starts a module of `tests/foreign`.
    pub fn line(&self, module: &str) -> String {
        let folder = root().join("tests/foreign");
        let program = self.program.display();
        format!("cd '{}' && exec '{program}' -m {module}", folder.display())
    }

    /// Runs a program of `tests/foreign` to its end.
    ///
    /// # Errors
    /// It failed.
    pub fn run(&self, arguments: &[&str]) -> Result<()> {
        process::run(&mut self.command(arguments))
    }
}

/// The environment of other people's physics; costs nothing where it is there.
///
/// # Errors
/// There is no Python 3 with `venv`; a package cannot be installed.
pub fn environment() -> Result<Python> {
    with_packages("venv", "requirements.txt")
}

/// The environment of what the controller is measured against: solvers, code generators, a C
/// compiler.
///
/// # Errors
/// As [`environment`].
pub fn of_the_bench() -> Result<Python> {
    with_packages("venv-bench", "bench.txt")
}

/// Makes the environment where it is missing or its packages have changed.
fn with_packages(name: &str, list: &str) -> Result<Python> {
    let wanted = root().join("tests/foreign").join(list);
    let wanted_text =
        fs::read_to_string(&wanted).with_context(|| format!("cannot read {}", wanted.display()))?;
    let folder = target_folder().join("foreign").join(name);
    let program = folder.join("bin/python");
    let stamp = folder.join(list);
    if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted_text) {
        return Ok(Python { program });
    }
    if !process::succeeds(Command::new("python3").args(["-m", "venv", "--help"])) {
        bail!("this needs Python 3 with its module venv (on Debian: apt-get install python3-venv)");
    }
    println!("installing the packages of tests/foreign/{list}");
    process::run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    process::run(
        Command::new(&program)
            .args(["-m", "pip", "install", "--quiet", "--requirement"])
            .arg(&wanted),
    )?;
    fs::write(&stamp, wanted_text).with_context(|| format!("cannot write {}", stamp.display()))?;
    Ok(Python { program })
}
