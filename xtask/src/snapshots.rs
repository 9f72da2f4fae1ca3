//! `measure`, `bless`, `budget`: three ways to run the one test that measures
//! (`tests/tests/budgets.rs`).

use anyhow::Result;

use crate::arguments::none;
use xtask::process::{self, cargo};
use xtask::setup::{self, Extent};

/// # Errors
/// Setup, or the measurement failed; differences from the snapshots and budgets are printed and
/// accepted.
pub fn measure(arguments: &[String]) -> Result<()> {
    none(arguments)?;
    run("measure", &[])
}

/// # Errors
/// Setup, or the measurement failed.
pub fn bless(arguments: &[String]) -> Result<()> {
    none(arguments)?;
    run("bless", &[])
}

/// # Errors
/// Setup; a figure is over its budget.
pub fn budget(arguments: &[String]) -> Result<()> {
    none(arguments)?;
    run("budget", &["budget"])
}

fn run(mode: &str, filter: &[&str]) -> Result<()> {
    let toolchain = setup::run(Extent::Build)?;
    let mut command = cargo(&[
        "test",
        "--quiet",
        "--package",
        "sinew-tests",
        "--test",
        "budgets",
    ]);
    command.args(["--", "--nocapture"]).args(filter);
    command.env("SINEW_SNAPSHOTS", mode);
    process::run(toolchain.equip(&mut command))
}
