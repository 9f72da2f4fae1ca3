//! Keeps committed models up to date: each is printed from its `model.toml` and weights, and what
//! stands beside them must be the same bytes.

use std::fs;
use std::path::{Path, PathBuf};

use crate::emit::{self, EmitOptions};
use crate::spec::SpecError;
use crate::store::{self, MODEL_FILE, StoreError};

/// Error of printing models.
#[derive(Debug, thiserror::Error)]
pub enum RegenerateError {
    /// A model cannot be read, or a file not written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A model is not valid.
    #[error("{}: {error}", directory.display())]
    Spec {
        /// Folder of the model.
        directory: PathBuf,
        /// Cause.
        #[source]
        error: SpecError,
    },
}

/// Prints the crate of the model in `model` into `out`, touching only files that differ, and names
/// those.
///
/// # Errors
/// [`RegenerateError::Store`] if the model cannot be read or a file cannot be written.
pub fn write(
    model: &Path,
    out: &Path,
    options: &EmitOptions,
) -> Result<Vec<PathBuf>, RegenerateError> {
    let stale = stale(model, out, options)?;
    for (path, text) in &stale {
        sinew_files::write(path, text.as_bytes()).map_err(StoreError::from)?;
    }
    Ok(stale.into_iter().map(|(path, _)| path).collect())
}

/// Prints every model in `models` in its place and names the files that changed.
///
/// # Errors
/// As [`write()`], at the first model that has one.
pub fn write_all(models: &Path) -> Result<Vec<PathBuf>, RegenerateError> {
    let mut changed = Vec::new();
    for model in directories(models)? {
        changed.extend(write(&model, &model, &EmitOptions::default())?);
    }
    Ok(changed)
}

/// The files in `models` that are missing or not what their model prints; none if all is up to
/// date.
///
/// # Errors
/// [`RegenerateError::Store`] if a model cannot be read.
pub fn check_all(models: &Path) -> Result<Vec<PathBuf>, RegenerateError> {
    let mut found = Vec::new();
    for model in directories(models)? {
        let stale = stale(&model, &model, &EmitOptions::default())?;
        found.extend(stale.into_iter().map(|(path, _)| path));
    }
    Ok(found)
}

fn stale(
    model: &Path,
    out: &Path,
    options: &EmitOptions,
) -> Result<Vec<(PathBuf, String)>, RegenerateError> {
    let spec = store::load(model)?;
    let files = emit::emit(&spec, options).map_err(|error| RegenerateError::Spec {
        directory: model.into(),
        error,
    })?;
    Ok(files
        .into_iter()
        .map(|file| (out.join(file.path), file.text))
        // A file that cannot be read is one to be written, whatever the reason.
        .filter(|(path, text)| fs::read(path).ok().as_deref() != Some(text.as_bytes()))
        .collect())
}

/// The directories in `models` that hold a model, by name.
fn directories(models: &Path) -> Result<Vec<PathBuf>, RegenerateError> {
    let mut found = Vec::new();
    for entry in fs::read_dir(models).map_err(|error| StoreError::io(models, error))? {
        let path = entry.map_err(|error| StoreError::io(models, error))?.path();
        if path.join(MODEL_FILE).is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
