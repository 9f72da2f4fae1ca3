//! Uneven sampling: rows that are missing, and rows at uneven times.

use super::finding::{Check, counted, number};
use super::series::quantile;
use crate::recording::Recording;

/// A step of this many usual ones is a gap.
const GAP: f64 = 8.0;

/// A usual deviation of the steps of this part of their middle is uneven.
const UNEVEN: f64 = 0.15;

/// Fewest rows that say anything of sampling.
const FEWEST: usize = 16;

/// `gap` and `irregular_sampling`.
pub(super) fn detect(recording: &Recording) -> Vec<Check> {
    let t = recording.t();
    if t.len() < FEWEST {
        return Vec::new();
    }
    let steps: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = quantile(steps.iter().copied(), 0.5);
    let usual = quantile(steps.iter().copied(), 0.9).max(middle);
    let mut found = Vec::new();
    let gaps: Vec<usize> = (0..steps.len())
        .filter(|&k| steps[k] > GAP * usual)
        .collect();
    if let Some(&longest) = gaps.iter().max_by(|a, b| steps[**a].total_cmp(&steps[**b])) {
        let sentence = format!(
            "{} in time: the longest lasts {} s, from t = {}, where rows are usually {} s apart",
            counted(gaps.len(), "gap"),
            number(steps[longest]),
            number(t[longest]),
            number(middle),
        );
        let remedy = "cut the recording in two at the gap if the input is unknown there; an input \
                      holds its last value over it";
        found.push(Check::likely(
            recording,
            longest + 1,
            "gap",
            sentence,
            remedy,
        ));
    }
    let deviation = quantile(steps.iter().map(|step| (step - middle).abs()), 0.5);
    if deviation > UNEVEN * middle {
        let [low, high] = [0.05, 0.95].map(|part| quantile(steps.iter().copied(), part));
        let first = (0..steps.len()).find(|&k| (steps[k] - middle).abs() > UNEVEN * middle);
        let sentence = format!(
            "rows lie unevenly in time: nine in ten are {} to {} s apart, {} s in the middle",
            number(low),
            number(high),
            number(middle)
        );
        let remedy = "none is needed where t is the time of the measurement; if it is the time of \
                      arrival, let the device stamp its samples";
        let row = first.unwrap_or(0) + 1;
        found.push(Check::likely(
            recording,
            row,
            "irregular_sampling",
            sentence,
            remedy,
        ));
    }
    found
}
