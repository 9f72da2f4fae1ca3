//! Temporary files that exist at this moment.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::FileError;

static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Tells two writers of the same file in one process apart.
static COUNTER: AtomicU32 = AtomicU32::new(0);

/// A name for a file beside `path` that nobody else writes; its folder is made.
pub(crate) fn beside(path: &Path) -> Result<PathBuf, FileError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(|error| {
        let error = if folder.is_file() {
            std::io::ErrorKind::NotADirectory.into()
        } else {
            error
        };
        FileError::write(folder, error)
    })?;
    let name = path.file_name().ok_or_else(|| {
        FileError::write(
            path,
            std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a file name"),
        )
    })?;
    let mut temporary_name = std::ffi::OsString::from(".");
    temporary_name.push(name);
    let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
    temporary_name.push(format!(".{}-{unique}.tmp", std::process::id()));
    Ok(folder.join(temporary_name))
}

/// While it lives no temporary file is made.
#[must_use = "hold it until the process ends"]
pub struct AllRemoved {
    _held: MutexGuard<'static, Vec<PathBuf>>,
}

/// Removes every temporary file that a writer in this process has not finished: for a Ctrl-C
/// handler, which holds the result until it ends the process.
pub fn remove_unfinished() -> AllRemoved {
    let mut unfinished = unfinished();
    for path in unfinished.drain(..) {
        // The writer may have renamed it in the meantime.
        let _ = fs::remove_file(path);
    }
    AllRemoved { _held: unfinished }
}

/// Under the lock, so that no file exists that [`remove_unfinished`] does not know.
pub(crate) fn create(temporary: &Path) -> std::io::Result<fs::File> {
    let mut unfinished = unfinished();
    let file = fs::File::create(temporary)?;
    unfinished.push(temporary.to_path_buf());
    Ok(file)
}

/// A temporary file that is finished or gone.
pub(crate) fn forget(temporary: &Path) {
    unfinished().retain(|other| other != temporary);
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    // A panicking writer cannot leave the list half-changed: push and retain are the only changes.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}
