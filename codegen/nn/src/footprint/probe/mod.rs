//! Bare images for a Cortex-M4F: one for QEMU, which tries networks, and one that is only linked.
//!
//! The sources lie beside this file. The crate `cases` holds the tried networks, by a function
//! `run` and a trait `Bench`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::target::{self, TARGET};
use crate::{BuildError, Network};

/// Files of the crate `image`, which runs in QEMU.
const IMAGE: [(&str, &str); 4] = [
    ("image/Cargo.toml", include_str!("image.toml")),
    ("image/memory.x", include_str!("memory.x")),
    ("image/build.rs", include_str!("build_script.rs")),
    ("image/src/main.rs", include_str!("image.rs")),
];

/// Files of the workspace and of the crates `cases` and `bare`, whatever the network.
const WORKSPACE: [(&str, &str); 3] = [
    ("Cargo.toml", include_str!("workspace.toml")),
    ("cases/src/bench.rs", BENCH),
    ("bare/build.rs", include_str!("bare/build_script.rs")),
];

/// Calls of a network without state.
const STATELESS: [(&str, &str); 3] = [
    ("cases/src/lib.rs", include_str!("cases/stateless.rs")),
    (
        "bare/src/bin/predict.rs",
        include_str!("bare/stateless_predict.rs"),
    ),
    (
        "bare/src/bin/jacobian.rs",
        include_str!("bare/stateless_jacobian.rs"),
    ),
];

/// Calls of a network with state.
const STATEFUL: [(&str, &str); 3] = [
    ("cases/src/lib.rs", include_str!("cases/stateful.rs")),
    (
        "bare/src/bin/predict.rs",
        include_str!("bare/stateful_predict.rs"),
    ),
    (
        "bare/src/bin/jacobian.rs",
        include_str!("bare/stateful_jacobian.rs"),
    ),
];

/// Manifests that end with the table of the dependency `network`, to which its package is added.
const MANIFESTS: [(&str, &str); 2] = [
    ("cases/Cargo.toml", include_str!("cases/manifest.toml")),
    ("bare/Cargo.toml", include_str!("bare/manifest.toml")),
];

/// Files of the crate `layers`, whatever the network.
const LAYERS: [(&str, &str); 4] = [
    ("layers/Cargo.toml", include_str!("layers/manifest.toml")),
    ("layers/memory.x", include_str!("memory.x")),
    ("layers/build.rs", include_str!("build_script.rs")),
    ("layers/src/main.rs", include_str!("layers/image.rs")),
];

/// The trait of the crate `cases`.
pub const BENCH: &str = include_str!("bench.rs");

/// Writes the crate `image` into a workspace, touching only files that differ.
///
/// # Errors
/// [`BuildError::File`].
pub fn write(workspace: &Path) -> Result<(), BuildError> {
    put(workspace, &IMAGE)
}

/// Writes a whole workspace around the crate `network`, which is there already.
///
/// # Errors
/// [`BuildError::File`].
pub(super) fn write_workspace(network: &Network, folder: &Path) -> Result<(), BuildError> {
    put(folder, &IMAGE)?;
    put(folder, &WORKSPACE)?;
    for (path, text) in MANIFESTS {
        let text = format!("{text}package = \"{}\"\n", network.name);
        put(folder, &[(path, &text)])?;
    }
    let is_stateful = network.state() > 0;
    put(folder, &LAYERS)?;
    let call = if is_stateful {
        include_str!("layers/stateful.rs")
    } else {
        include_str!("layers/stateless.rs")
    };
    put(folder, &[("layers/src/call.rs", call)])?;
    put(folder, if is_stateful { &STATEFUL } else { &STATELESS })
}

fn put(folder: &Path, files: &[(&str, &str)]) -> Result<(), BuildError> {
    for (path, text) in files {
        sinew_files::write_changed(folder.join(path), text.as_bytes())?;
    }
    Ok(())
}

/// Builds the image and gives its path.
///
/// # Errors
/// As [`target::build`].
pub fn build(workspace: &Path) -> Result<PathBuf, BuildError> {
    image(workspace, "image")
}

/// As [`build`], of the image that goes through a network layer by layer.
pub(super) fn build_layers(workspace: &Path) -> Result<PathBuf, BuildError> {
    image(workspace, "layers")
}

fn image(workspace: &Path, package: &str) -> Result<PathBuf, BuildError> {
    target::build(workspace, package)?;
    let release = workspace.join("target").join(TARGET).join("release");
    Ok(release.join(package))
}

/// Runs the image in QEMU and returns its output. An instruction takes 1,024 ns there: the timer of
/// 40 ns counts them exactly.
///
/// # Errors
/// [`BuildError::Qemu`] if QEMU cannot be started, [`BuildError::Run`] if the image did not end
/// well.
pub fn run(image: &Path) -> Result<String, BuildError> {
    let output = Command::new("qemu-system-arm")
        .args(["-machine", "mps2-an386", "-cpu", "cortex-m4"])
        .args(["-display", "none", "-monitor", "none"])
        .args(["-serial", "null", "-icount", "shift=10,sleep=off"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .output()
        .map_err(BuildError::Qemu)?;
    if !output.status.success() {
        return Err(BuildError::Run {
            status: output.status,
            complaints: String::from_utf8_lossy(&output.stderr).into(),
        });
    }
    Ok(String::from_utf8_lossy(&output.stdout).into())
}
