//! Uneven sampling: rows that are missing, and rows at uneven times.

use super::finding::{Check, counted, number};
use super::series::quantile;
use crate::recording::Recording;

/// A step of this many usual ones is a gap.
const GAP: f64 = 8.0;

/// A usual deviation of the steps of this part of their middle is uneven.
const UNEVEN: f64 = 0.15;

/// Part of the steps that are far from their middle where rows lie unevenly.
const MANY: f64 = 0.2;

/// Part of the steps that are alike where rows are even.
const EVEN: f64 = 0.75;

/// Least part of all steps that lost rows make.
const LOST: f64 = 0.01;

/// Fewest rows that say anything of sampling.
const FEWEST: usize = 16;

/// `gap` and `irregular_sampling`; `driven`: some input of the recording changes.
pub(super) fn detect(recording: &Recording, driven: bool) -> Vec<Check> {
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
    // Without an input nothing is unknown between two rows.
    if gaps.is_empty() && driven {
        found.extend(lost(recording, &steps, middle));
    }
    let deviations = steps.iter().map(|step| (step - middle).abs());
    let deviation = |part: f64| quantile(deviations.clone(), part);
    if deviation(0.5) > UNEVEN * middle || deviation(1.0 - MANY) > 0.5 * middle {
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

/// Rows that a recorder lost one by one: steps of two usual ones or a few more among even ones.
fn lost(recording: &Recording, steps: &[f64], middle: f64) -> Option<Check> {
    let rows = |step: f64| step / middle;
    let whole = |step: f64| (rows(step) - rows(step).round()).abs() < 0.1;
    let alike = steps
        .iter()
        .filter(|step| (rows(**step) - 1.0).abs() < 0.05);
    let even = alike.count() as f64 >= EVEN * steps.len() as f64;
    let long: Vec<usize> = (0..steps.len())
        .filter(|&k| rows(steps[k]) > 1.5 && whole(steps[k]))
        .collect();
    let count: f64 = long.iter().map(|&k| rows(steps[k]).round() - 1.0).sum();
    let many = long.len() as f64 >= (LOST * steps.len() as f64).max(3.0);
    (even && many).then(|| {
        let sentence = format!(
            "about {} are missing, one or a few at a time, the first behind t = {}: an input holds \
             its last value there",
            counted(count as usize, "row"),
            number(recording.t()[long[0]]),
        );
        let remedy = "record slower or over a faster link, so that no row is lost";
        Check::likely(recording, long[0] + 1, "gap", sentence, remedy)
    })
}
