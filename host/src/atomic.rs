//! Files appear whole or not at all.
//!
//! A result is written beside its place under a temporary name and renamed into it. A program that is
//! stopped by a signal calls [`remove_unfinished`] so that no temporary file stays behind.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::{Error, Result};

/// Temporary files that exist at this moment.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Tells two writers of the same file in one process apart.
static COUNTER: AtomicU32 = AtomicU32::new(0);

/// Writes `contents` to `path`, whole or not at all; an existing file is replaced. Folders that are
/// missing on the way are made.
///
/// # Errors
/// `Write` where the folder cannot be made, the disk is full, or the name is a folder's.
pub fn write(path: impl AsRef<Path>, contents: impl AsRef<[u8]>) -> Result<()> {
    let path = path.as_ref();
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))?;
    let name = path.file_name().ok_or_else(|| {
        Error::write(
            path,
            std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a file name"),
        )
    })?;
    let mut temporary_name = std::ffi::OsString::from(".");
    temporary_name.push(name);
    let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
    temporary_name.push(format!(".{}-{unique}.tmp", std::process::id()));
    let temporary = folder.join(temporary_name);

    remember(&temporary);
    let written = fs::File::create(&temporary)
        .and_then(|mut file| {
            file.write_all(contents.as_ref())
                .and_then(|()| file.sync_all())
        })
        .and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // Best effort: the first error is the one worth reporting.
        let _ = fs::remove_file(&temporary);
    }
    forget(&temporary);
    written.map_err(|source| Error::write(path, source))
}

/// Removes every temporary file that a writer in this process has not finished: for a Ctrl-C handler,
/// just before it ends the process.
pub fn remove_unfinished() {
    for path in unfinished().drain(..) {
        // The writer may have renamed it in the meantime.
        let _ = fs::remove_file(path);
    }
}

fn unfinished() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    // A panicking writer cannot leave the list half-changed: push and retain are the only changes.
    UNFINISHED
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn remember(path: &Path) {
    unfinished().push(path.to_path_buf());
}

fn forget(path: &Path) {
    unfinished().retain(|other| other != path);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_no_temporary_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/deep/result.txt");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("occupied");
        fs::create_dir(&occupied).unwrap();
        fs::write(occupied.join("inside"), "x").unwrap();
        assert!(write(&occupied, "two").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
