//! Files that are either the old one or the new one, never half of one.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// A file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file system refused.
    #[error("{}: {error}", file.display())]
    Io {
        /// Path of the file.
        file: PathBuf,
        /// Reason that the file system gave.
        #[source]
        error: std::io::Error,
    },
    /// The file is larger than any model's.
    #[error("{}: larger than the {max} bytes that a model's file may have", file.display())]
    TooLarge {
        /// Path of the file.
        file: PathBuf,
        /// Largest accepted.
        max: u64,
    },
}

impl FileError {
    pub(crate) fn io(file: &Path, error: std::io::Error) -> Self {
        Self::Io {
            file: file.into(),
            error,
        }
    }
}

/// Replaces the file at `path`, making its directory first: written beside it, flushed to the disk,
/// then renamed.
///
/// # Errors
/// [`FileError::Io`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    // The process id keeps two programs that write the same model from sharing a file.
    let temporary = path.with_added_extension(format!("{}.tmp", std::process::id()));
    let result = path
        .parent()
        .map_or(Ok(()), fs::create_dir_all)
        .and_then(|()| File::create(&temporary))
        .and_then(|mut file| {
            file.write_all(bytes)?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&temporary, path));
    result.map_err(|error| {
        // The first error is the one to report; there may be no temporary file at all.
        let _ = fs::remove_file(&temporary);
        FileError::io(path, error)
    })
}

/// Writes a file unless it has these contents already: what is built from it is then up to date
/// too.
///
/// # Errors
/// [`FileError::Io`].
pub fn write_changed(path: &Path, contents: &[u8]) -> Result<(), FileError> {
    if fs::read(path).is_ok_and(|old| old == contents) {
        return Ok(());
    }
    write(path, contents)
}

/// Contents of a file of at most `max` bytes.
///
/// # Errors
/// [`FileError`].
pub fn read(path: &Path, max: u64) -> Result<Vec<u8>, FileError> {
    let mut bytes = Vec::new();
    // The limit holds for what is read, not for what the file system claims: it may be a device.
    File::open(path)
        .and_then(|file| file.take(max + 1).read_to_end(&mut bytes))
        .map_err(|error| FileError::io(path, error))?;
    if bytes.len() as u64 > max {
        return Err(FileError::TooLarge {
            file: path.into(),
            max,
        });
    }
    Ok(bytes)
}
