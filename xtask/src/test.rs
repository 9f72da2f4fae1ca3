//! `cargo xtask test`: every test there is, counted once, at the end.

use std::process::Command;

use anyhow::{Result, bail};

use crate::tally::Tally;
use xtask::process::{self, Failed, cargo, root, run_watched};
use xtask::setup::Toolchain;

/// Boards whose images take part in tests.
const TESTED_BOARDS: &[&str] = &["qemu", "host"];

/// Everything that holds tests, but for documentation. Examples do not, and cargo would compile
/// them all the same.
const PROGRAMS: &[&str] = &["--tests"];

/// # Errors
/// An image does not build; a test failed or a test program did not run to its end.
pub fn run(toolchain: &Toolchain) -> Result<()> {
    let mut tally = Tally::default();

    // Images first: the tests in QEMU start them, and a compile error is seen at once.
    for board in TESTED_BOARDS {
        build_board(toolchain, board)?;
    }
    for kind in [PROGRAMS, &["--doc"]] {
        let mut workspace = cargo(&["test", "--workspace", "--no-fail-fast"]);
        workspace.args(kind).args(["--", "--show-output"]);
        // A changed snapshot fails and leaves no file behind, here as on any other machine.
        workspace
            .env("INSTA_UPDATE", "no")
            .env_remove("INSTA_FORCE_PASS");
        count(&mut tally, toolchain.equip(&mut workspace))?;
    }

    println!("\n{tally}");
    if !tally.is_green() {
        bail!("not every test passed");
    }
    Ok(())
}

/// Compiles every test of the workspace and runs none.
///
/// # Errors
/// One does not compile.
pub fn compile(toolchain: &Toolchain) -> Result<()> {
    // Where a clean build's time goes: target/cargo-timings.
    let mut command = cargo(&["test", "--workspace", "--no-run", "--quiet", "--timings"]);
    command.args(PROGRAMS);
    process::run(toolchain.equip(&mut command))
}

/// Links every image of a board.
///
/// # Errors
/// One does not compile, or does not fit the memory that its linker script grants.
pub fn build_board(toolchain: &Toolchain, board: &str) -> Result<()> {
    let folder = root().join("boards").join(board);
    process::run(&mut toolchain.board_cargo(&folder, "build", &[]))
}

/// Runs tests and counts them. A failing test does not stop the count, a program that breaks off is
/// noted.
fn count(tally: &mut Tally, command: &mut Command) -> Result<()> {
    let failed_before = tally.failed;
    match run_watched(command, |line| tally.see(line)) {
        Ok(()) => Ok(()),
        Err(error) => {
            let Some(Failed { line, .. }) = error.downcast_ref() else {
                return Err(error);
            };
            if tally.failed == failed_before {
                tally.broken.push(line.clone());
            }
            Ok(())
        }
    }
}
