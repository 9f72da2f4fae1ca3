//! Parameters of which each recording has a value of its own: `per` in a parameter's own table.

use super::reader::TableReader;
use crate::error::Error;

impl TableReader<'_> {
    /// True where the parameter `key` of this table, written in `own` with `value`, has a value of
    /// its own in each recording.
    pub(super) fn per_recording(
        &self,
        key: &str,
        own: &TableReader,
        value: f64,
    ) -> Result<bool, Error> {
        if own.word("per", &[("recording", ())])?.is_none() {
            return Ok(false);
        }
        let refused = |why: &str| {
            let message = format!("{} cannot differ by recording: {why}", own.what);
            own.error_at("per", message)
        };
        match key {
            "start" | "start_velocity" => Err(refused("a start always does")
                .helped("leave `per` out; a fit estimates the start of each recording")),
            "slope" => Err(refused("all recordings share a slope")
                .helped("write `per` beside `value`, where the column is zero")),
            "inertia" if value == 0.0 => Err(refused("it is zero, and its size is not known")
                .helped("give `value` a size, or leave `per` out")),
            _ => Ok(true),
        }
    }
}
