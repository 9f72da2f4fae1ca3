//! Files that are either the old one or the new one, never half of one.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use super::StoreError;

/// Replaces the file at `path`, making its directory first: written beside it, flushed to the disk,
/// then renamed.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
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
        StoreError::io(path, error)
    })
}
