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
/// then renamed. A link is followed; a pipe or a device is written through.
///
/// # Errors
/// [`FileError::Io`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let end = fs::canonicalize(path);
    let place = end.as_deref().unwrap_or(path);
    if fs::metadata(place).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        let written = File::options().write(true).open(place);
        return written
            .and_then(|mut stream| stream.write_all(bytes))
            .map_err(|error| FileError::io(path, error));
    }
    replace(place, bytes).map_err(|error| FileError::io(path, error))
}

fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
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
    result.inspect_err(|_| {
        // The first error is the one to report; there may be no temporary file at all.
        let _ = fs::remove_file(&temporary);
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_followed_and_a_device_stays() {
        let folder = std::env::temp_dir().join(format!("sinew-nn-files-{}", std::process::id()));
        let (kept, link) = (folder.join("kept.txt"), folder.join("link.txt"));
        write(&kept, b"old").expect("the folder can be made");
        std::os::unix::fs::symlink(&kept, &link).expect("a link can be made");
        write(&link, b"new").expect("it can be written");
        assert_eq!(fs::read(&kept).expect("it is there"), b"new");
        let metadata = fs::symlink_metadata(&link).expect("it is there");
        assert!(metadata.is_symlink());
        let null = folder.join("null");
        std::os::unix::fs::symlink("/dev/null", &null).expect("a link can be made");
        write(&null, b"gone").expect("a device takes it");
        assert!(!fs::metadata("/dev/null").expect("it is there").is_file());
        fs::remove_dir_all(&folder).expect("it can be removed");
    }
}
