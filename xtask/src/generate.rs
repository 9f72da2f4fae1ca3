//! `cargo xtask generate`: the committed crates of `models/` are what the emitter prints today.

use std::process::Command;

use anyhow::{Result, bail};

use xtask::process::{self, root};

/// # Errors
/// With `--check`, a generated file differs from what the emitter prints.
pub fn run(arguments: &[String]) -> Result<()> {
    match arguments {
        [] => emit(),
        [flag] if flag == "--check" => check(),
        [other, ..] => bail!("unexpected argument '{other}'; there is only --check"),
    }
}

/// Not a stage of CI: a test of codegen asks the same.
fn check() -> Result<()> {
    process::run(&mut regenerate(&["--check"])?)
}

fn emit() -> Result<()> {
    process::run(&mut regenerate(&[])?)
}

fn regenerate(arguments: &[&str]) -> Result<Command> {
    let mut command = Command::new(process::example("regenerate")?);
    command.args(arguments).arg("models").current_dir(root());
    Ok(command)
}
