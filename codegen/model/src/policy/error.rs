//! Errors of a policy's files.

use std::path::PathBuf;

use sinew_files::FileError;
use sinew_nn::NetworkError;

/// Error of reading, writing or printing a policy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The network is not valid, or cannot be read.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// `policy.toml` is not in the format.
    #[error("{}: {message}", file.display())]
    Text {
        /// Path of the file.
        file: PathBuf,
        /// Place and cause.
        message: String,
    },
    /// The parts do not belong together.
    #[error("{}: {message}", file.display())]
    Spec {
        /// Path of the file.
        file: PathBuf,
        /// Cause.
        message: String,
    },
}
