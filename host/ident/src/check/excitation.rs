//! Recordings in which nothing moves: they determine nothing.

use super::finding::{Check, number};
use crate::noise::noise_level;
use crate::recording::Recording;

/// A signal whose spread is below this many times its white noise is nothing but noise.
const NOISE_ALONE: f64 = 1.15;

/// Fewest samples that tell noise from motion.
const FEWEST: usize = 64;

/// `no_excitation`: every sensor shows noise alone.
pub(super) fn detect(recording: &Recording, sensors: &[String]) -> Option<Check> {
    let mut words = Vec::new();
    for name in sensors {
        let values = recording.column(name)?;
        let valid: Vec<f64> = values.iter().copied().filter(|y| y.is_finite()).collect();
        if valid.len() < FEWEST {
            return None;
        }
        let mean = valid.iter().sum::<f64>() / valid.len() as f64;
        let squares: f64 = valid.iter().map(|y| (y - mean).powi(2)).sum();
        let spread = (squares / valid.len() as f64).sqrt();
        let noise = noise_level(recording.t(), values);
        if noise <= 0.0 || spread > NOISE_ALONE * noise {
            return None;
        }
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
