//! Times that are no seconds, without a rig: by the size of their steps.

use super::finding::{Check, number};
use crate::recording::Recording;

/// Rows at least this far apart (s) are unusual for a mechanical device.
const SLOW: f64 = 0.999;

/// `time_in_milliseconds` of times that look like it: whole numbers, a second or more apart, beside
/// a mechanical signal.
pub(super) fn detect(recording: &Recording) -> Option<Check> {
    let step = recording.interval()?;
    let units = recording.columns().iter();
    let mechanical = units
        .map(|column| sinew_sim::unit::of_column(&column.name))
        .any(|unit| {
            matches!(
                unit,
                "rad" | "deg" | "rad/s" | "N" | "N m" | "m/s" | "m" | "mm"
            )
        });
    let whole = recording.t().iter().all(|t| *t == t.round());
    if step < SLOW || !mechanical || !whole || recording.len() < 16 {
        return None;
    }
    let (or_rows, remedy) = if step == 1.0 {
        (
            ", or count the rows",
            "--time-unit ms if they are; divide by the rows a second if they count rows",
        )
    } else {
        ("", "--time-unit ms if they are")
    };
    let sentence = format!(
        "rows are {} s apart, in whole numbers: the times look like milliseconds{or_rows}",
        number(step)
    );
    Some(Check::likely(
        recording,
        0,
        "time_in_milliseconds",
        sentence,
        remedy,
    ))
}
