//! Cargo for the microcontroller.

use std::path::Path;
use std::process::Command;

use crate::BuildError;

/// Every Cortex-M4F with its floating-point unit in use.
pub const TARGET: &str = "thumbv7em-none-eabihf";

fn set(name: &str) -> Option<std::ffi::OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// Returns true if this machine can build for the target.
#[must_use]
pub fn is_installed() -> bool {
    if set("SINEW_FIRMWARE_BUILD_STD").is_some_and(|value| value == "1") {
        return true;
    }
    let rustc = set("SINEW_FIRMWARE_RUSTC").unwrap_or("rustc".into());
    let library = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", TARGET])
        .output();
    library.is_ok_and(|library| Path::new(String::from_utf8_lossy(&library.stdout).trim()).is_dir())
}

/// Cargo as the environment names it: rustup's by default, another as `cargo xtask setup` found it.
fn cargo() -> Command {
    let mut cargo = Command::new(set("SINEW_FIRMWARE_CARGO").unwrap_or("cargo".into()));
    // Flags and tools meant for the program that calls are not the firmware's.
    for name in [
        "RUSTC",
        "RUSTC_WRAPPER",
        "RUSTFLAGS",
        "CARGO_ENCODED_RUSTFLAGS",
        "CARGO_BUILD_TARGET",
    ] {
        cargo.env_remove(name);
    }
    if let Some(rustc) = set("SINEW_FIRMWARE_RUSTC") {
        cargo.env("RUSTC", rustc);
    }
    if set("SINEW_FIRMWARE_BUILD_STD").is_some_and(|value| value == "1") {
        cargo
            .env("RUSTC_BOOTSTRAP", "1")
            .env("CARGO_UNSTABLE_BUILD_STD", "core");
    }
    cargo
}

/// Builds a package of the workspace in `folder`, release, into `folder/target`.
///
/// # Errors
/// [`BuildError::Cargo`], or [`BuildError::Compile`] for an error or a warning.
pub fn build(folder: &Path, package: &str) -> Result<(), BuildError> {
    let output = cargo()
        .args(["build", "--quiet", "--release"])
        .args(["--package", package, "--target", TARGET])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .output()
        .map_err(BuildError::Cargo)?;
    let complaints = String::from_utf8_lossy(&output.stderr);
    if output.status.success() && complaints.is_empty() {
        return Ok(());
    }
    Err(BuildError::Compile {
        package: package.into(),
        folder: folder.into(),
        complaints: complaints.trim_end().into(),
    })
}
