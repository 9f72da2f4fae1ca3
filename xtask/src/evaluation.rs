//! Verbs that `tests/evaluation` carries out, so that whoever only builds or tests does not compile
//! them.

use std::process::Command;

use anyhow::Result;

use xtask::process::{self, root};

/// # Errors
/// The exit status of the program.
pub fn run(verb: &str, arguments: &[String]) -> Result<()> {
    let mut command = Command::new(process::program("sinew-evaluation")?);
    process::run(command.arg(verb).args(arguments).current_dir(root()))
}
