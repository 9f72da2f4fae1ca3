//! A model on disk: a directory with `model.toml` (what a person reads and edits) and
//! `weights.safetensors` (the numbers). docs/reference/model-files.md describes both.
//!
//! ```no_run
//! use sinew_model::store;
//!
//! let spec = store::load("models/reference-s".as_ref())?;
//! store::save("target/copy".as_ref(), &spec)?;
//! # Ok::<(), store::StoreError>(())
//! ```
//!
//! A file that is not what it claims to be gives an error that names file and line, or tensor:
//! ```
//! use sinew_model::store;
//!
//! let error = store::parse("format = \"sinew-model/2\"", &[]).unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "model.toml:1: the format is \"sinew-model/2\": this program reads \"sinew-model/1\""
//! );
//! ```

mod error;
mod quote;
mod state;
mod text;
mod weights;

use std::path::Path;

pub use error::StoreError;
pub use sinew_nn::store::WEIGHTS_FILE;

use sinew_files::{read, write};

use crate::spec::ModelSpec;

/// Format that `model.toml` names.
pub const FORMAT: &str = "sinew-model/1";
/// The description's file name.
pub const MODEL_FILE: &str = "model.toml";

/// Larger than any description that [`crate::spec::limits`] admits.
const MAX_TEXT_BYTES: u64 = 256 * 1024;
/// Larger than any weights that [`crate::spec::limits`] admits, header and golden vectors included.
const MAX_WEIGHTS_BYTES: u64 = 4 * 1024 * 1024;

/// Reads and validates the model in `directory`.
///
/// # Errors
/// [`StoreError::NotAModel`] of a file, [`StoreError::Io`] if one cannot be read,
/// [`StoreError::TooLarge`] before reading one that no
/// model needs, otherwise as [`parse`].
pub fn load(directory: &Path) -> Result<ModelSpec, StoreError> {
    if directory.is_file() {
        return Err(StoreError::NotAModel {
            file: directory.into(),
        });
    }
    let text = read(directory.join(MODEL_FILE), MAX_TEXT_BYTES)?;
    let weights = read(directory.join(WEIGHTS_FILE), MAX_WEIGHTS_BYTES)?;
    let text = String::from_utf8(text).map_err(|error| StoreError::Text {
        file: directory.join(MODEL_FILE),
        line: text::line_of(error.as_bytes(), error.utf8_error().valid_up_to()),
        message: "the file is not UTF-8 text".into(),
    })?;
    parse(&text, &weights).map_err(|error| error.within(directory))
}

/// Reads and validates a model from the contents of its two files.
///
/// # Errors
/// [`StoreError::Text`] and [`StoreError::Weights`] if one is not in the format,
/// [`StoreError::Spec`] if together they are no valid model.
pub fn parse(text: &str, weights: &[u8]) -> Result<ModelSpec, StoreError> {
    let mut spec = text::parse(text)?;
    weights::fill(&mut spec, weights)?;
    spec.validate().map_err(|error| text::locate(text, error))?;
    Ok(spec)
}

/// Validates `spec` and writes it to `directory`, which is made if it is not there. Each file is
/// replaced in one step; the description, which makes a directory a model, comes last.
///
/// # Errors
/// [`StoreError::Spec`] before anything is written, [`StoreError::Io`] if a file cannot be written.
pub fn save(directory: &Path, spec: &ModelSpec) -> Result<(), StoreError> {
    for (file, contents) in print(spec).map_err(|error| error.within(directory))? {
        write(directory.join(file), &contents)?;
    }
    Ok(())
}

/// The files of a model by name, for a program that has its own way of writing files; in the order
/// in which [`save`] writes them.
///
/// # Errors
/// [`StoreError::Spec`] if the specification is not valid.
pub fn print(spec: &ModelSpec) -> Result<[(&'static str, Vec<u8>); 2], StoreError> {
    spec.validate().map_err(|error| StoreError::Spec {
        file: MODEL_FILE.into(),
        line: None,
        error,
    })?;
    let weights = weights::print(spec)?;
    Ok([
        (WEIGHTS_FILE, weights),
        (MODEL_FILE, text::print(spec).into_bytes()),
    ])
}
