//! Programs that a build needs: what is missing is said before minutes go into what is built.

use std::path::Path;
use std::process::Command;

use super::Board;
use crate::device;
use sinew_ident::error::{Error, Result};

/// The target of every Cortex-M4F with its floating-point unit in use.
pub(super) const TARGET: &str = "thumbv7em-none-eabihf";

/// Target of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// The one that this program runs on.
    ThisOne,
    /// A Cortex-M4F, by the toolchain that `cargo xtask setup` found.
    Microcontroller,
}

impl Machine {
    /// The machine that a board's programs run on.
    pub fn of(board: Board) -> Self {
        match board {
            Board::Host => Self::ThisOne,
            Board::Qemu | Board::Stm32f446 | Board::Nrf52840 => Self::Microcontroller,
        }
    }
}

/// Makes sure that programs for `board` can be built, and run where it is QEMU.
///
/// # Errors
/// cargo, the target's core library or QEMU is missing.
pub fn ready(board: Board) -> Result<()> {
    let on = Machine::of(board);
    let mut command = match on {
        Machine::ThisOne => cargo("cargo"),
        Machine::Microcontroller => firmware_cargo(),
    };
    command.arg("--version").output().map_err(no_cargo)?;
    let builds_core = std::env::var("SINEW_FIRMWARE_BUILD_STD").is_ok_and(|v| v == "1");
    if on == Machine::Microcontroller && !builds_core {
        has_target()?;
    }
    if board == Board::Qemu {
        device::has_qemu()?;
    }
    Ok(())
}

/// The core library of [`TARGET`] lies where the compiler looks for it. A compiler that cannot be
/// asked is cargo's to judge.
fn has_target() -> Result<()> {
    let rustc = std::env::var("SINEW_FIRMWARE_RUSTC").unwrap_or_else(|_| "rustc".into());
    let mut command = cargo(&rustc);
    command.args(["--print", "target-libdir", "--target", TARGET]);
    let Ok(answer) = command.output() else {
        return Ok(());
    };
    let folder = String::from_utf8_lossy(&answer.stdout);
    if !answer.status.success() || Path::new(folder.trim()).is_dir() {
        return Ok(());
    }
    let error = format!("Rust's core library for the microcontroller, {TARGET}, is not installed");
    Err(Error::failed(error).help(target_help()))
}

/// Remedy for a target that is not installed.
pub(super) fn target_help() -> String {
    format!("run `cargo xtask setup`, or `rustup target add {TARGET}`")
}

/// Error where cargo does not start.
pub(super) fn no_cargo(error: std::io::Error) -> Error {
    Error::failed(format!("cargo cannot be run: {error}"))
        .help("install Rust from rustup, or name cargo in SINEW_FIRMWARE_CARGO")
}

pub(super) fn cargo(program: &str) -> Command {
    let mut command = Command::new(program);
    // A cargo that runs this program hands its own settings down; the firmware's build has its own.
    for name in ["RUSTC", "RUSTC_WRAPPER", "RUSTDOC", "CARGO_BUILD_TARGET"] {
        command.env_remove(name);
    }
    command
}

/// cargo for the microcontroller: rustup's by default, another as `cargo xtask setup` found it.
pub(super) fn firmware_cargo() -> Command {
    let program = std::env::var("SINEW_FIRMWARE_CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = cargo(&program);
    if let Ok(rustc) = std::env::var("SINEW_FIRMWARE_RUSTC") {
        command.env("RUSTC", rustc);
    }
    if std::env::var("SINEW_FIRMWARE_BUILD_STD").is_ok_and(|v| v == "1") {
        command
            .env("RUSTC_BOOTSTRAP", "1")
            .env("CARGO_UNSTABLE_BUILD_STD", "core");
    }
    command
}
