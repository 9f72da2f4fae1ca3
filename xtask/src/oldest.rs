//! The declared `rust-version` of each crate that runs on a chip, and of a printed network: all
//! compile with exactly that compiler, for this machine and for a Cortex-M4F.
//!
//! The compiler comes from rustup. Without rustup, or where it cannot fetch one, the stage says so
//! and proves nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result};
use xtask::process::{self, root, succeeds, target_folder};

/// Target of the boards.
const CHIP: &str = "thumbv7em-none-eabihf";
/// Crates of this workspace that need nothing of others, and hence its lock file as it is.
const ALONE: [&str; 2] = ["firmware/mpc", "codegen/kernels"];
/// A generated controller, a workspace of its own: compiles `sinew-device` as well.
const CONTROLLER: &str = "models/reference-s";
/// Networks that hold recurrent layers, convolutions and pools between them.
const NETWORKS: [&str; 4] = [
    "keras-gru.keras",
    "keras-lstm-stream.keras",
    "keras-lenet.keras",
    "keras-global-pools.keras",
];
const FRAMEWORKS: &str = "codegen/nn/tests/frameworks/models";

/// # Errors
/// A crate that does not compile with the version that it declares.
pub fn check() -> Result<()> {
    let controller = root().join(CONTROLLER);
    lock(&controller)?;
    for folder in ALONE {
        compile(&root().join(folder))?;
    }
    compile(&controller)?;
    for network in NETWORKS {
        compile(&printed(network)?)?;
    }
    Ok(())
}

/// Gives a generated crate, which has no lock file of its own, the versions of the workspace: those
/// that the boards' crates have compiled, and none that asks for more than the declared compiler.
///
/// # Errors
/// The folder is not writable.
pub fn lock(model: &Path) -> Result<()> {
    let (new, lock) = (model.join("Cargo.lock.new"), model.join("Cargo.lock"));
    fs::copy(root().join("Cargo.lock"), &new)
        .and_then(|_| fs::rename(&new, &lock))
        .with_context(|| format!("cannot write {}", lock.display()))
}

/// `cargo +VERSION check` of the crate in `folder`, for both targets.
fn compile(folder: &Path) -> Result<()> {
    let version = declared(folder)?;
    if !installed(&version) {
        println!(
            "WARNING: rustup has no Rust {version} and cannot install it: that {} compiles with \
             it is NOT CHECKED",
            folder.display()
        );
        return Ok(());
    }
    for chip in [false, true] {
        let mut command = Command::new("cargo");
        command
            .arg(format!("+{version}"))
            .args(["check", "--quiet"]);
        // Cargo's own variables name the compiler that runs this program.
        command.env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
        command.env_remove("CARGO");
        if chip {
            command.args(["--target", CHIP]);
        }
        command
            .arg("--manifest-path")
            .arg(folder.join("Cargo.toml"));
        command
            .arg("--target-dir")
            .arg(target_folder().join("oldest").join(&version));
        process::run(command.current_dir(root()))?;
    }
    Ok(())
}

/// The `rust-version` in the manifest of `folder`.
fn declared(folder: &Path) -> Result<String> {
    let path = folder.join("Cargo.toml");
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {path:?}"))?;
    let version = text
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = \""));
    let version = version.and_then(|rest| rest.strip_suffix('"'));
    Ok(version
        .with_context(|| format!("{} declares no rust-version", path.display()))?
        .to_string())
}

/// Tells whether rustup has this version for both targets, after it was asked to install it.
fn installed(version: &str) -> bool {
    let cargo = format!("+{version}");
    let core = Command::new("rustc")
        .args([&cargo, "--print", "target-libdir", "--target", CHIP])
        .env_remove("RUSTUP_TOOLCHAIN")
        .output();
    let there = core.is_ok_and(|answer| {
        let folder = PathBuf::from(String::from_utf8_lossy(&answer.stdout).trim());
        answer.status.success() && folder.is_dir()
    });
    there
        || succeeds(
            Command::new("rustup")
                .args(["toolchain", "install", version])
                .args(["--profile", "minimal", "--target", CHIP]),
        )
}

/// The crate that `sinew-nn` prints from one of its committed networks.
fn printed(network: &str) -> Result<PathBuf> {
    let out = target_folder().join("oldest/printed").join(network);
    let mut command = Command::new(process::example("import")?);
    command.arg(Path::new(FRAMEWORKS).join(network)).arg(&out);
    process::run(command.current_dir(root()).stdout(Stdio::null()))?;
    // Cargo would take it for a forgotten member of the workspace around it.
    let manifest = out.join("Cargo.toml");
    let text = fs::read_to_string(&manifest)?;
    fs::write(&manifest, text + "\n[workspace]\n")?;
    Ok(out)
}
