//! `cargo xtask survive`: the long versions of tests that continuous integration runs short.

use std::process::Command;

use anyhow::Result;

use crate::arguments::none;
use crate::{evaluation, foreign};
use xtask::process::{self, cargo};
use xtask::setup::{self, Extent};

/// Ten million frames from a hostile peer, a hundred thousand random states, an hour of control at
/// 120 Hz, a million stops of a step, every printed network in QEMU.
const LONG: &[(&str, &str)] = &[
    ("SINEW_HOSTILE_FRAMES", "10000000"),
    ("SINEW_WORST_STATES", "100000"),
    ("SINEW_SOAK_STEPS", "432000"),
    ("SINEW_STOPS", "1000000"),
    ("SINEW_NETWORKS", "1"),
];

/// Test programs, by package, whose length those variables set.
const PROGRAMS: &[(&str, &str)] = &[
    ("sinew-device", "hostile"),
    ("sinew-tests", "endurance"),
    ("sinew-mpc", "stops"),
    ("sinew-mpc", "state"),
    ("sinew-nn", "networks"),
];

/// Every stage, or `networks [COUNT [SEED]]` alone.
///
/// # Errors
/// Setup, or a test failed.
pub fn run(arguments: &[String]) -> Result<()> {
    if let Some(("networks", numbers)) = arguments.split_first().map(|(a, rest)| (a.as_str(), rest))
    {
        return foreign::run(foreign::numbers(numbers)?);
    }
    none(arguments)?;
    let toolchain = setup::run(Extent::Build)?;
    for (package, test) in PROGRAMS {
        let mut command = long(package, test);
        process::run(toolchain.equip(&mut command))?;
    }
    let mut seeded = cargo(&["test", "--package", "sinew-ident", "--test", "check"]);
    process::run(seeded.args(["--", "--ignored", "--nocapture"]))?;
    evaluation::run("proof", &["--committed".into()])?;
    foreign::run(foreign::numbers(&[])?)
}

fn long(package: &str, test: &str) -> Command {
    let mut command = cargo(&[
        "test",
        "--package",
        package,
        "--test",
        test,
        "--",
        "--nocapture",
    ]);
    command.envs(LONG.iter().copied());
    command
}
