//! Verbs that `tests/evaluation` carries out, so that whoever only builds or tests does not compile
//! them.

use anyhow::Result;

use xtask::process::{self, cargo};

/// # Errors
/// The exit status of the program.
pub fn run(verb: &str, arguments: &[String]) -> Result<()> {
    let mut command = cargo(&["run", "--quiet", "--package", "sinew-evaluation", "--"]);
    process::run(command.arg(verb).args(arguments))
}
