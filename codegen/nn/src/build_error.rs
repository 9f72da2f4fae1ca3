//! Errors of compiling and measuring a network.

use std::path::PathBuf;
use std::process::ExitStatus;

use crate::NetworkError;
use sinew_files::FileError;

/// Error of a network that is compiled for a microcontroller, or run in QEMU.
///
/// # Design
/// Each variant keeps the file, the folder or the program that failed, and its cause as a source,
/// so that a caller can tell a missing tool from a bad network without reading the message.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The network is not valid.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// A source file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file that `sinew emit` did not write stands in the place of one that it would.
    #[error(
        "{} was not written by `sinew emit` and would be replaced; name another folder or move it",
        file.display()
    )]
    Foreign {
        /// Path of the file.
        file: PathBuf,
    },
    /// No board has this name.
    #[error("there is no board {name:?}: expected one of {expected}")]
    Board {
        /// As given.
        name: String,
        /// Names of the boards.
        expected: String,
    },
    /// Cargo cannot be started.
    #[error("cargo cannot be run: {0}")]
    Cargo(#[source] std::io::Error),
    /// Cargo ended with errors or warnings.
    #[error("building {package} in {} failed:\n{complaints}{}", folder.display(), help(complaints))]
    Compile {
        /// Package that was built.
        package: String,
        /// Workspace of the package.
        folder: PathBuf,
        /// Output of the compiler.
        complaints: String,
    },
    /// A linked image is no ELF file.
    #[error("{}: {error}", file.display())]
    Image {
        /// Path of the image.
        file: PathBuf,
        /// Reason that the reader gave.
        #[source]
        error: object::read::Error,
    },
    /// QEMU cannot be started.
    #[error("qemu-system-arm: {0} (cargo xtask setup installs it)")]
    Qemu(#[source] std::io::Error),
    /// The program in QEMU failed.
    #[error("QEMU ended with {status}: {complaints}")]
    Run {
        /// Exit status of QEMU.
        status: ExitStatus,
        /// Output of QEMU.
        complaints: String,
    },
}

/// A line of advice for complaints with a known cause.
fn help(complaints: &str) -> &'static str {
    if complaints.contains("target may not be installed") {
        "\nhelp: cargo xtask setup, or rustup target add thumbv7em-none-eabihf"
    } else {
        ""
    }
}
