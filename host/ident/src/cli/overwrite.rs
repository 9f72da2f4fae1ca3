//! Results that would replace what they are made from, or each other, or that cannot be written at
//! all: refused before the work.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// The same file, however it is written; a file that does not exist is only itself.
pub fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// No result may replace what it was made from, or another result, and each can be written. Each
/// path comes with what names it, a flag or words.
///
/// # Errors
/// `Arguments`, with both names; `Write`.
pub fn refuse<'a>(
    read: impl IntoIterator<Item = (&'static str, &'a Path)>,
    written: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>,
) -> Result<()> {
    let read = read.into_iter().map(|(name, path)| (identity(path), name));
    let mut taken: Vec<(PathBuf, &str)> = read.collect();
    for (flag, path) in written {
        let Some(path) = path else { continue };
        if crate::atomic::is_stream(path) {
            continue;
        }
        let file = identity(path);
        if let Some((_, before)) = taken.iter().find(|(other, _)| *other == file) {
            let path = path.display();
            return Err(Error::arguments(format!(
                "{flag} {path} would overwrite what {before} names"
            ))
            .help("give it another name"));
        }
        crate::atomic::prepare(path)?;
        taken.push((file, flag));
    }
    Ok(())
}
