//! A bare image for QEMU's Cortex-M4F that tries networks: results, instructions, stack. The sources lie beside
//! this file; what is tried is a crate `cases` with a function `run` and a trait `Bench`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::files;
use crate::target::{self, TARGET};

/// The crate's files.
const FILES: &[(&str, &str)] = &[
    ("Cargo.toml", include_str!("image.toml")),
    ("memory.x", include_str!("memory.x")),
    ("build.rs", include_str!("build_script.rs")),
    ("src/main.rs", include_str!("image.rs")),
];

/// What the crate `cases` has to say besides its `run`.
pub const BENCH: &str = "
/// What tries networks: a computer, or a board.
pub trait Bench {
    /// Prints numbers.
    fn numbers(&mut self, name: &str, values: &mut dyn Iterator<Item = f32>);
    /// Runs and measures.
    fn measure(&mut self, name: &str, work: &mut dyn FnMut());
}
";

/// Writes the crate into `workspace/image`, touching only files that differ.
///
/// # Errors
/// A file cannot be written.
pub fn write(workspace: &Path) -> Result<(), String> {
    for (path, text) in FILES {
        files::write_changed(&workspace.join("image").join(path), text.as_bytes())
            .map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// Builds the image and gives its path.
///
/// # Errors
/// What cargo says.
pub fn build(workspace: &Path) -> Result<PathBuf, String> {
    target::build(workspace, "image")?;
    Ok(workspace.join("target").join(TARGET).join("release/image"))
}

/// What the image says when it runs in QEMU, where an instruction takes 1,024 ns: the timer of 40 ns counts
/// them exactly.
///
/// # Errors
/// QEMU is not there, or the image did not end well.
pub fn run(image: &Path) -> Result<String, String> {
    let output = Command::new("qemu-system-arm")
        .args([
            "-machine",
            "mps2-an386",
            "-cpu",
            "cortex-m4",
            "-display",
            "none",
            "-monitor",
            "none",
        ])
        .args(["-serial", "null", "-icount", "shift=10,sleep=off"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .output()
        .map_err(|error| format!("qemu-system-arm: {error} (cargo xtask setup installs it)"))?;
    if !output.status.success() {
        let complaints = String::from_utf8_lossy(&output.stderr);
        return Err(format!("QEMU ended with {}: {complaints}", output.status));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into())
}
