//! Errors of a network.

/// Error of a network that cannot be read or emitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// The file is not what it claims to be, or contradicts itself.
    #[error("{place}: {message}")]
    Malformed {
        /// Layer, tensor or part of the file.
        place: String,
        /// Cause, and the expected form.
        message: String,
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
}

impl NetworkError {
    /// A [`NetworkError::Malformed`].
    pub fn malformed(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Malformed {
            place: place.into(),
            message: message.into(),
        }
    }

    /// A [`NetworkError::TooLarge`].
    pub fn too_large(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::TooLarge {
            place: place.into(),
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
            Self::Malformed { place, message } => {
                Self::malformed(format!("{file}: {place}"), message)
            }
            Self::TooLarge { place, message } => {
                Self::too_large(format!("{file}: {place}"), message)
            }
            // Its own words begin with the layer, and the file is what was asked for.
            unsupported @ Self::Unsupported { .. } => unsupported,
        }
    }
}
