//! Numbers that stand for "no value", and single samples far outside everything else.

use super::finding::{Check, number, rows};
use super::series::{Series, quantile, sizes};
use crate::recording::Recording;

/// A value this many ranges of all others away from them is none of them.
const FAR: f64 = 3.0;

/// A single sample that leaves and returns by this many usual steps is none of the motion.
const SPIKE: f64 = 12.0;

/// Largest part of a column that is taken for a sentinel.
const PART: f64 = 0.2;

/// `sentinel` and `spike` of one column.
pub(super) fn detect(recording: &Recording, name: &str, values: &[f64]) -> Option<Check> {
    let series = Series::of(values)?;
    let found = far_value(&series).or_else(|| dropouts(&series));
    if let Some((value, at)) = found {
        let sentence = format!(
            "{} stands in {} of {name}, far from everything around it, as loggers write for \
             \"no value\"",
            value,
            rows(at.len())
        );
        let remedy = format!("--missing {value}");
        return Some(Check::certain(
            recording, at[0], "sentinel", sentence, remedy,
        ));
    }
    let spikes = spikes(&series);
    let first = *spikes.first()?;
    let sentence = format!(
        "{} of {name} jump away and back: {} at the first, between {} and {}",
        rows(spikes.len()),
        number(series.samples[first].1),
        number(series.samples[first - 1].1),
        number(series.samples[first + 1].1),
    );
    let row = series.samples[first].0;
    let remedy = "leave these fields empty: an empty field is a missing sample";
    Some(Check::likely(recording, row, "spike", sentence, remedy))
}

/// A value at one end of the range, far from all others, that recurs or is a round number: with
/// its rows.
fn far_value(series: &Series) -> Option<(f64, Vec<usize>)> {
    series.range.into_iter().find_map(|value| {
        let at: Vec<usize> = (series.samples.iter())
            .filter(|sample| sample.1 == value)
            .map(|sample| sample.0)
            .collect();
        let others = || series.samples.iter().map(|s| s.1).filter(|y| *y != value);
        let low = others().fold(f64::INFINITY, f64::min);
        let high = others().fold(f64::NEG_INFINITY, f64::max);
        let distance = (value - high).max(low - value);
        let round = value == value.round() && value.abs() >= 99.0;
        let few = (at.len() as f64) < PART * series.samples.len() as f64;
        let far = high > low && distance > FAR * (high - low);
        (few && far && (round || at.len() >= 2)).then_some((value, at))
    })
}

/// One exact value that the column jumps to and back from again and again: with its rows.
fn dropouts(series: &Series) -> Option<(f64, Vec<usize>)> {
    let spikes = spikes(series);
    let value = series.samples[*spikes.first()?].1;
    let same = spikes.iter().all(|&k| series.samples[k].1 == value);
    let elsewhere = series.samples.iter().filter(|s| s.1 == value).count();
    // A resting device shows the same value in rows that are no jumps.
    (same && spikes.len() >= 3 && elsewhere <= 2 * spikes.len()).then(|| {
        let rows = spikes.iter().map(|&k| series.samples[k].0);
        (value, rows.collect())
    })
}

/// Indices of samples that lie far outside both neighbours, where these lie close together.
fn spikes(series: &Series) -> Vec<usize> {
    let steps = series.steps();
    let usual = quantile(sizes(&steps), 0.98);
    let found: Vec<usize> = (1..steps.len())
        .filter(|&k| {
            let (to, from) = (steps[k - 1], steps[k]);
            let least = to.abs().min(from.abs());
            to * from < 0.0 && least > SPIKE * usual && (to + from).abs() < 0.5 * least
        })
        .collect();
    let few = (found.len() as f64) < 0.05 * series.samples.len() as f64;
    if usual > 0.0 && few {
        found
    } else {
        Vec::new()
    }
}
