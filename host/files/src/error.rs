//! Files that cannot be read or written.

use std::path::{Path, PathBuf};

/// A file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file system refused to read.
    #[error("{}: {error}", file.display())]
    Read {
        /// Path of the file.
        file: PathBuf,
        /// Reason that the file system gave.
        #[source]
        error: std::io::Error,
    },
    /// The file system refused to write, to make a folder or to remove.
    #[error("{}: {error}", file.display())]
    Write {
        /// Path of the file or folder.
        file: PathBuf,
        /// Reason that the file system gave.
        #[source]
        error: std::io::Error,
    },
    /// The file is larger than the limit.
    #[error("{}: larger than {max} bytes, the most that is read", file.display())]
    TooLarge {
        /// Path of the file.
        file: PathBuf,
        /// Largest accepted, bytes.
        max: u64,
    },
}

impl FileError {
    /// A file that could not be read.
    pub fn read(file: impl AsRef<Path>, error: std::io::Error) -> Self {
        let file = file.as_ref().into();
        Self::Read { file, error }
    }

    /// A file or folder that could not be written.
    pub fn write(file: impl AsRef<Path>, error: std::io::Error) -> Self {
        let file = file.as_ref().into();
        Self::Write { file, error }
    }
}
