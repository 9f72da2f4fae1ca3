//! `cargo xtask foreign`: what other people's physics wrote is written again.
//!
//! The only part of the repository that needs Python. What it writes is committed, so that tests
//! and continuous integration do without.

pub mod python;

use anyhow::{Result, bail};

/// Programs of `tests/foreign`, as arguments to Python, in the order in which they run.
const PROGRAMS: &[&[&str]] = &[
    &["mass_spring_damper.py"],
    &["damper_stand.py"],
    &["payload.py"],
    &["finger.py"],
    &["foam.py"],
    &["pad.py"],
    &["mujoco_trajectories.py"],
    &["mujoco_rests.py"],
    &["-m", "hardlaw.check"],
    &["-m", "hardlaw.exact"],
    &["-m", "hardlaw.committed"],
];

/// # Errors
/// There is no Python, a package cannot be installed, a program failed.
pub fn run(arguments: &[String]) -> Result<()> {
    if let Some(argument) = arguments.first() {
        bail!("unexpected argument '{argument}'");
    }
    let python = python::environment()?;
    for program in PROGRAMS {
        python.run(program)?;
    }
    Ok(())
}
