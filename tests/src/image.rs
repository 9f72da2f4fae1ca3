//! Board images: built by cargo in the board's own folder, found by what cargo says it built.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// Top folder of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// Folder of a board.
pub fn board_folder(board: &str) -> PathBuf {
    root().join("boards").join(board)
}

/// Builds one program of a board, optimised, and returns the linked file. Quick when nothing has changed.
///
/// A board for a chip (one with a `.cargo/config.toml`) is built by the toolchain that the environment
/// names: `SINEW_FIRMWARE_CARGO`, `SINEW_FIRMWARE_RUSTC`, `SINEW_FIRMWARE_BUILD_STD` (`cargo xtask setup`).
///
/// # Errors
/// What cargo printed, when it does not build.
pub fn build(board: &str, program: &str) -> Result<PathBuf, String> {
    let folder = board_folder(board);
    let for_a_chip = folder.join(".cargo/config.toml").is_file();
    let variable = |name: &str| std::env::var_os(name).filter(|_| for_a_chip);

    let cargo = variable("SINEW_FIRMWARE_CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(&folder).args(["build", "--release"]);
    if let Some(rustc) = variable("SINEW_FIRMWARE_RUSTC") {
        command.env("RUSTC", rustc);
    }
    if variable("SINEW_FIRMWARE_BUILD_STD").is_some_and(|value| value == "1") {
        command.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
    }
    command.args(["--message-format=json-render-diagnostics", "--bin", program]);
    // Beside the workspace's own outputs, as `cargo xtask test` does: the host program embeds the boards'
    // folders and would be built again after each build in there.
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    command
        .arg("--target-dir")
        .arg(root().join(target).join("boards"));

    let output = command
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("cannot start cargo for boards/{board}: {error}"))?;
    if !output.status.success() {
        let errors = String::from_utf8_lossy(&output.stderr);
        return Err(format!("boards/{board} does not build:\n{errors}"));
    }
    let messages = String::from_utf8_lossy(&output.stdout);
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .find(|message| message["executable"].is_string() && message["target"]["name"] == program)
        .and_then(|message| message["executable"].as_str().map(PathBuf::from))
        .ok_or_else(|| format!("cargo built boards/{board}, but no program '{program}'"))
}

/// Version of the compiler that builds images, as `rustc --version` prints it.
pub fn compiler() -> Option<String> {
    let rustc = std::env::var_os("SINEW_FIRMWARE_RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_string())
}

/// Why images cannot be run here, if so. A test that depends on QEMU asks first and says so
/// ([`crate::skip`]).
pub fn cannot_run() -> Option<&'static str> {
    let qemu = Command::new("qemu-system-arm").arg("--version").output();
    if qemu.is_err() {
        return Some("no qemu-system-arm (cargo xtask setup)");
    }
    if std::env::var_os("SINEW_FIRMWARE_CARGO").is_some() {
        return None;
    }
    let libraries = Command::new("rustc")
        .args([
            "--print",
            "target-libdir",
            "--target",
            "thumbv7em-none-eabihf",
        ])
        .output();
    let present = libraries.is_ok_and(|output| {
        let folder = String::from_utf8_lossy(&output.stdout).trim().to_string();
        Path::new(&folder).is_dir()
    });
    (!present).then_some("no target thumbv7em-none-eabihf (cargo xtask setup)")
}
