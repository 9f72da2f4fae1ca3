//! One signal and its scaling.

use super::limits::MAX_NAME;
use super::{Role, SpecError};

/// One scalar signal: `model = (physical - offset) / span` (docs/reference/model-files.md, eq. 2).
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// The recording's column, for instance `q_m`.
    pub name: String,
    /// The physical unit, for people; `1` for none.
    pub unit: String,
    /// Physical units in one model unit; positive.
    pub span: f64,
    /// The physical value that is zero in model units.
    pub offset: f64,
}

impl Signal {
    pub(super) fn validate(&self, role: Role, index: usize) -> Result<(), SpecError> {
        for (what, text) in [("name", &self.name), ("unit", &self.unit)] {
            let length = text.chars().count();
            if !(1..=MAX_NAME).contains(&length) || text.chars().any(char::is_control) {
                return Err(SpecError::SignalText {
                    role,
                    index,
                    what,
                    text: text.chars().take(MAX_NAME).collect(),
                    max: MAX_NAME,
                });
            }
        }
        // The firmware multiplies by 1 / span in f32, so both must be normal there.
        let usable = |x: f64| x > 0.0 && (x as f32).is_normal() && (1.0 / x as f32).is_normal();
        if !usable(self.span) {
            return Err(SpecError::Span {
                role,
                index,
                name: self.name.clone(),
                span: self.span,
            });
        }
        if !(self.offset as f32).is_finite() {
            return Err(SpecError::Offset {
                role,
                index,
                name: self.name.clone(),
                offset: self.offset,
            });
        }
        Ok(())
    }
}
