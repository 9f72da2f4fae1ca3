//! `sinew-diagnosis/1`.

use crate::diagnose::Diagnosis;
use crate::error::{Error, Result};

/// The finding as JSON, a line break at its end (docs/reference/results.md).
///
/// # Errors
/// `Failed` where it cannot be written, which its types exclude.
pub fn json(diagnosis: &Diagnosis) -> Result<String> {
    serde_json::to_string_pretty(diagnosis)
        .map(|text| text + "\n")
        .map_err(|error| Error::failed(format!("the finding cannot be written as JSON: {error}")))
}
