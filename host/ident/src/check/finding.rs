//! A fault of a recording, as it is said.

use serde::Serialize;

use crate::recording::Recording;

/// A fault that a detector named. Its JSON is in docs/reference/results.md.
///
/// ```
/// use sinew_ident::check::check;
/// use sinew_ident::recording::Recording;
///
/// let mut text = String::from("t,q_m\n");
/// for k in 0..400 {
///     text += &format!("{},{}\n", 10 * k, (0.05 * f64::from(k)).sin());
/// }
/// let found = check(&[Recording::parse(text.as_bytes(), "a.csv")?], None);
/// assert_eq!((found[0].kind, found[0].line), ("time_in_milliseconds", 2));
/// assert!(found[0].remedy.contains("--time-unit"), "{}", found[0].remedy);
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// File of the recording.
    pub file: String,
    /// First line that shows it, from 1.
    pub line: usize,
    /// Kind of fault, such as `time_in_milliseconds`.
    pub kind: &'static str,
    /// Nothing that is computed from the recording as it is would be right.
    pub certain: bool,
    /// The fault with its numbers, one sentence.
    pub sentence: String,
    /// Flag or key that mends it.
    pub remedy: String,
}

impl Check {
    /// A fault that is certain, at a row.
    pub(super) fn certain(
        recording: &Recording,
        row: usize,
        kind: &'static str,
        sentence: String,
        remedy: impl Into<String>,
    ) -> Self {
        debug_assert!(
            super::KINDS.contains(&kind),
            "{kind} is not among the kinds"
        );
        Self {
            file: recording.path().display().to_string(),
            line: recording.line(row),
            kind,
            certain: true,
            sentence,
            remedy: remedy.into(),
        }
    }

    /// A fault that may be the device's own doing.
    pub(super) fn likely(
        recording: &Recording,
        row: usize,
        kind: &'static str,
        sentence: String,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            certain: false,
            ..Self::certain(recording, row, kind, sentence, remedy)
        }
    }
}

/// `row` or `rows` behind a number.
pub(super) fn rows(count: usize) -> String {
    counted(count, "row")
}

/// A number and a word that takes an `s` unless there is one.
pub(super) fn counted(count: usize, word: &str) -> String {
    format!("{count} {word}{}", if count == 1 { "" } else { "s" })
}

/// Three significant digits.
pub(super) fn number(value: f64) -> String {
    crate::report::significant(value, 3)
}
