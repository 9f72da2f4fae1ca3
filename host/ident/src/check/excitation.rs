//! Recordings in which nothing moves: they determine nothing.

use super::finding::{Check, number};
use crate::noise::noise_alone;
use crate::recording::Recording;

/// `no_excitation`: every sensor shows noise alone.
pub(super) fn detect(recording: &Recording, sensors: &[String]) -> Option<Check> {
    let mut words = Vec::new();
    for name in sensors {
        let values = recording.column(name)?;
        let spread = noise_alone(recording.t(), values)?;
        words.push(format!("{name} by {}", number(spread)));
    }
    if words.is_empty() {
        return None;
    }
    let sentence = format!(
        "nothing moves: {} is noise alone, and these rows determine no parameter",
        words.join(" and ")
    );
    let remedy = "drive the device; `sinew excite RIG --out experiment.csv` designs an experiment";
    Some(Check::likely(
        recording,
        0,
        "no_excitation",
        sentence,
        remedy,
    ))
}
