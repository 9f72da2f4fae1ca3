//! Reasons for which no preference can be learned.

use std::fmt;

/// A fault of the candidates or of an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// Fewer than two candidates.
    TooFew(usize),
    /// A candidate with another number of features than the first, or one that is not finite.
    Features {
        /// Index of the candidate.
        candidate: usize,
        /// Number of features of the first.
        expected: usize,
    },
    /// An answer about a candidate that is not there, or about one and the same.
    Pair {
        /// Index of the answer.
        answer: usize,
        /// Number of candidates.
        candidates: usize,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew(count) => write!(f, "{count} candidates: at least two are needed"),
            Self::Features {
                candidate,
                expected,
            } => write!(
                f,
                "candidate {candidate} needs {expected} finite features, as the first has"
            ),
            Self::Pair { answer, candidates } => write!(
                f,
                "answer {answer} must name two different ones of {candidates} candidates"
            ),
        }
    }
}

impl std::error::Error for Error {}
