//! Errors of reading and writing a model.

use std::path::{Path, PathBuf};

use sinew_files::FileError;

use crate::spec::SpecError;

/// Error of reading or writing a model; every message begins with the file.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused.
    #[error("{}: {error}", file.display())]
    Io {
        /// Path of the file.
        file: PathBuf,
        /// Reason that the file system gave.
        #[source]
        error: std::io::Error,
    },
    /// A file in the place of a model's folder.
    #[error(
        "{}: a file; a model is a folder with model.toml and weights.safetensors, as `sinew train \
         RIG --out FOLDER` writes it",
        file.display()
    )]
    NotAModel {
        /// Path of the file.
        file: PathBuf,
    },
    /// The file is larger than any model's.
    #[error("{}: larger than the {max} bytes that a model's file may have", file.display())]
    TooLarge {
        /// Path of the file.
        file: PathBuf,
        /// Largest accepted.
        max: u64,
    },
    /// `model.toml` is not in the format.
    #[error("{}:{line}: {message}", file.display())]
    Text {
        /// Path of the file.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// Cause.
        message: String,
    },
    /// `weights.safetensors` is not a safetensors file, or a tensor in it is not as `model.toml`
    /// says.
    #[error("{}: {message}", file.display())]
    Weights {
        /// Path of the file.
        file: PathBuf,
        /// Cause, with the name of the tensor.
        message: String,
    },
    /// Both files are in the format, but together they are no valid model.
    #[error("{}{}: {error}", file.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Spec {
        /// The file that states what is wrong.
        file: PathBuf,
        /// From 1, where the cause has one.
        line: Option<usize>,
        /// Cause.
        #[source]
        error: SpecError,
    },
}

impl StoreError {
    pub(crate) fn io(file: &Path, error: std::io::Error) -> Self {
        Self::Io {
            file: file.into(),
            error,
        }
    }

    pub(super) fn weights(message: impl Into<String>) -> Self {
        Self::Weights {
            file: super::WEIGHTS_FILE.into(),
            message: message.into(),
        }
    }

    /// The same error with the file's name made a path.
    pub(super) fn within(mut self, directory: &Path) -> Self {
        let (Self::Io { file, .. }
        | Self::NotAModel { file }
        | Self::TooLarge { file, .. }
        | Self::Text { file, .. }
        | Self::Weights { file, .. }
        | Self::Spec { file, .. }) = &mut self;
        *file = directory.join(&*file);
        self
    }
}

impl From<FileError> for StoreError {
    fn from(error: FileError) -> Self {
        match error {
            FileError::Read { file, error } | FileError::Write { file, error } => {
                Self::Io { file, error }
            }
            FileError::TooLarge { file, max } => Self::TooLarge { file, max },
        }
    }
}
