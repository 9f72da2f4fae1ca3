//! `cargo xtask generate`: the committed crates of `models/` are what the emitter prints today.

use anyhow::{Result, bail};

use xtask::process::{self, cargo};

/// # Errors
/// With `--check`, a generated file differs from what the emitter prints.
pub fn run(arguments: &[String]) -> Result<()> {
    match arguments {
        [] => emit(),
        [flag] if flag == "--check" => check(),
        [other, ..] => bail!("unexpected argument '{other}'; there is only --check"),
    }
}

fn emit() -> Result<()> {
    process::run(&mut codegen(&["write", "models"]))
}

/// Not a stage of CI: a test of codegen asks the same, and this builds half its libraries once
/// more, with the features of one crate alone.
fn check() -> Result<()> {
    process::run(&mut codegen(&["check", "models"]))
}

fn codegen(arguments: &[&str]) -> std::process::Command {
    let mut command = cargo(&["run", "--quiet", "--package", "sinew-model", "--"]);
    command.args(arguments);
    command
}
