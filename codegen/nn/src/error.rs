//! Errors of a network.

use std::error::Error;
use std::fmt;
use std::sync::Arc;

/// Error of a network that cannot be read or emitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// The file is not what it claims to be, or contradicts itself.
    #[error("{place}: {message}")]
    Malformed {
        /// Layer, tensor or part of the file.
        place: String,
        /// Reason, and the expected form.
        message: String,
        /// Error of the library or the system that read it, whose words are in `message`.
        #[source]
        cause: Option<Cause>,
    },
    /// It is sound, but not among what can be emitted.
    #[error("layer {layer:?}: {what} is not supported; {nearest}")]
    Unsupported {
        /// The layer.
        layer: String,
        /// Unsupported property.
        what: String,
        /// The nearest thing that would work.
        nearest: String,
    },
    /// It is larger than any board.
    #[error("{place}: {message}")]
    TooLarge {
        /// Layer, tensor or file.
        place: String,
        /// Found size, and the limit.
        message: String,
    },
    /// The text of an option has no such value.
    #[error("{message}")]
    Option {
        /// The text, and what was expected.
        message: String,
    },
}

impl NetworkError {
    /// A [`NetworkError::Malformed`].
    pub fn malformed(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Malformed {
            place: place.into(),
            message: message.into(),
            cause: None,
        }
    }

    /// A [`NetworkError::Malformed`] because of another error, which it says and keeps.
    ///
    /// ```
    /// use std::error::Error;
    /// use sinew_nn::import;
    ///
    /// let error = import::read("absent.onnx".as_ref()).expect_err("there is no such file");
    /// let cause = error.source().and_then(Error::source).expect("the system's own error");
    /// let system = cause.downcast_ref::<std::io::Error>().expect("an error of reading");
    /// assert_eq!(system.kind(), std::io::ErrorKind::NotFound);
    /// ```
    pub fn caused(place: impl Into<String>, cause: impl Error + Send + Sync + 'static) -> Self {
        Self::Malformed {
            place: place.into(),
            message: cause.to_string(),
            cause: Some(Cause(Arc::new(cause))),
        }
    }

    /// A [`NetworkError::TooLarge`].
    pub fn too_large(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::TooLarge {
            place: place.into(),
            message: message.into(),
        }
    }

    /// A [`NetworkError::Option`].
    pub(crate) fn option(message: impl Into<String>) -> Self {
        Self::Option {
            message: message.into(),
        }
    }

    /// A [`NetworkError::Unsupported`].
    pub fn unsupported(
        layer: impl Into<String>,
        what: impl Into<String>,
        nearest: impl Into<String>,
    ) -> Self {
        Self::Unsupported {
            layer: layer.into(),
            what: what.into(),
            nearest: nearest.into(),
        }
    }
}

impl NetworkError {
    /// The same error with the file before it.
    #[must_use]
    pub fn within(self, file: &str) -> Self {
        match self {
            Self::Malformed {
                place,
                message,
                cause,
            } => Self::Malformed {
                place: format!("{file}: {place}"),
                message,
                cause,
            },
            Self::TooLarge { place, message } => {
                Self::too_large(format!("{file}: {place}"), message)
            }
            // Its own words begin with the layer, and the file is what was asked for.
            other @ (Self::Unsupported { .. } | Self::Option { .. }) => other,
        }
    }
}

/// Error below a [`NetworkError`]; its [`source`](Error::source) is the error itself. Two are equal
/// if they say the same.
#[derive(Clone, Debug)]
pub struct Cause(Arc<dyn Error + Send + Sync>);

impl PartialEq for Cause {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_string() == other.0.to_string()
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Error for Cause {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        Some(&*self.0)
    }
}
