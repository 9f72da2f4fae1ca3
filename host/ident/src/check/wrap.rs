//! Counters that begin anew: an absolute encoder after each turn, a register that overflows.

use std::f64::consts::TAU;

use super::finding::{Check, counted, number};
use super::series::{Series, quantile};
use crate::recording::Recording;

/// Known periods are met to this part.
const EXACT: f64 = 0.02;

/// `wrapped_counter` of one column of a sensor.
pub(super) fn detect(recording: &Recording, name: &str, values: &[f64]) -> Option<Check> {
    let series = Series::of(values)?;
    let steps = series.steps();
    let usual = quantile(steps.iter().map(|step| step.abs()), 0.9);
    let jumps: Vec<usize> = (0..steps.len())
        .filter(|&k| steps[k].abs() > (0.6 * series.width()).max(8.0 * usual))
        .collect();
    let first = *jumps.first()?;
    let height = quantile(jumps.iter().map(|&k| steps[k].abs()), 1.0);
    let alike = jumps.iter().all(|&k| steps[k].abs() > 0.8 * height);
    // A whole period is at least as high as any jump and as the range, and at most the range and
    // one step more.
    let known = known_periods(name, height);
    let period = known.into_iter().find(|period| {
        (series.width() <= (1.0 + EXACT) * period) && (height - period).abs() < 0.1 * period
    });
    let moving = jumps.iter().filter(|&&k| goes_on(&steps, k)).count();
    let period = match period {
        Some(period) => period,
        // Of no known period: enough jumps in full motion, from one end of the range to the other.
        None if jumps.len() >= 3 && alike && 3 * moving > 2 * jumps.len() => height,
        None => return None,
    };
    if !alike || jumps.len() * 4 > steps.len() {
        return None;
    }
    let row = series.samples[first + 1].0;
    let sentence = format!(
        "{name} jumps by {} at {}, as a counter does that begins anew",
        number(period),
        counted(jumps.len(), "row")
    );
    let remedy = format!("--unwrap {name}={period}");
    Some(Check::certain(
        recording,
        row,
        "wrapped_counter",
        sentence,
        remedy,
    ))
}

/// Periods of counters in the column's unit: whole turns, and powers of two of plain counts.
fn known_periods(name: &str, height: f64) -> Vec<f64> {
    match sinew_sim::unit::of_column(name) {
        "rad" => vec![TAU],
        "mrad" => vec![1e3 * TAU],
        "deg" => vec![360.0],
        "rev" => vec![1.0],
        _ => (8..=32)
            .map(|bits| 2f64.powi(bits))
            .filter(|period| (height / period - 1.0).abs() < EXACT)
            .collect(),
    }
}

/// The motion before and after a jump has one direction, against the jump.
fn goes_on(steps: &[f64], jump: usize) -> bool {
    let before: f64 = steps[jump.saturating_sub(3)..jump].iter().sum();
    let after: f64 = steps[(jump + 1)..(jump + 4).min(steps.len())].iter().sum();
    before * after > 0.0 && before * steps[jump] < 0.0
}
