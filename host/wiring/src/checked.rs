//! Result of a check: faults and remarks.

use crate::file::Fault;

/// Result of a check.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// Faults: no sources are made.
    pub faults: Vec<Fault>,
    /// Remarks about what may not be meant.
    pub remarks: Vec<String>,
}
