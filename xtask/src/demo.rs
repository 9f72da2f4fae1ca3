//! `cargo xtask demo` and `emps`: the whole chain, through the `sinew` program.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use xtask::process::{self, cargo, root};
use xtask::setup::{self, Extent};

/// A recording pair and the rig that explains it.
struct Case {
    rig: &'static str,
    fit: PathBuf,
    test: PathBuf,
    out: &'static str,
    /// Effects that the recordings have and the rig has not
    /// (tests/foreign/mass_spring_damper.truth.json), if that is known.
    hidden: Option<&'static str>,
}

/// The rig and the recording that ship with the project.
///
/// # Errors
/// Setup, or the exit status of `sinew`.
pub fn demo(flags: &[String]) -> Result<()> {
    build(
        &Case {
            rig: "rigs/mass-spring-damper.toml",
            fit: "rigs/mass-spring-damper.fit.csv".into(),
            test: "rigs/mass-spring-damper.test.csv".into(),
            out: "target/demo",
            hidden: Some("coulomb_friction"),
        },
        flags,
    )
}

/// A real positioning axis: motor voltage in, position out.
///
/// # Errors
/// The recordings are not on this machine; setup; or the exit status of `sinew`.
pub fn emps(flags: &[String]) -> Result<()> {
    let Some(data) = data_folder() else {
        bail!(
            "the EMPS recordings are not here: set SINEW_DATA to the folder that holds emps/train.csv \
             and emps/test_pulses.csv"
        );
    };
    build(
        &Case {
            rig: "rigs/emps.toml",
            fit: data.join("emps/train.csv"),
            test: data.join("emps/test_pulses.csv"),
            out: "target/emps",
            hidden: None,
        },
        flags,
    )
}

/// The folder of the recordings, if those of EMPS are there.
fn data_folder() -> Option<PathBuf> {
    let folder = process::data_folder();
    let complete = ["emps/train.csv", "emps/test_pulses.csv"]
        .iter()
        .all(|file| folder.join(file).is_file());
    complete.then_some(folder)
}

fn build(case: &Case, flags: &[String]) -> Result<()> {
    let toolchain = setup::run(Extent::Build)?;
    let mut command = cargo(&["run", "--package", "sinew", "--", "build", case.rig]);
    let file = |path: &Path| path.as_os_str().to_os_string();
    command.arg("--fit").arg(file(&case.fit));
    command.arg("--test").arg(file(&case.test));
    command.args(["--board", "qemu", "--out", case.out]);
    if let Some(hidden) = case.hidden {
        command.args(["--diagnose", "--hidden", hidden]);
    }
    // Shared with the tests' boards: embassy is compiled once.
    if std::env::var_os("SINEW_BUILD_DIR").is_none() {
        command.env("SINEW_BUILD_DIR", root().join("target/boards"));
    }
    command.args(flags);
    process::run(toolchain.equip(&mut command))
}
