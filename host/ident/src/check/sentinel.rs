//! Numbers that stand for "no value", and single samples far outside everything else.

use super::finding::{Check, number, rows};
use super::series::{Series, quantile, sizes};
use crate::order;
use crate::recording::Recording;

/// A value this many ranges of all others away from them is none of them.
const FAR: f64 = 3.0;

/// A single sample that leaves and returns by this many usual steps is none of the motion.
const SPIKE: f64 = 12.0;

/// Largest part of a column that is taken for a sentinel.
const PART: f64 = 0.2;

/// The same of a sensor that else shows many values.
const PART_OF_SENSOR: f64 = 0.9;

/// Fewest other values of such a sensor, and their distance from the sentinel in ranges.
const MANY: (usize, f64) = (20, 10.0);

/// Part of all other samples that have a value of their own in a column of fine resolution.
const FINE: f64 = 0.9;

/// Jumps into and out of a value that recurs there, beside the usual steps of the motion.
const APART: f64 = 3.0;

/// Jumps into and out of a run are this many times the usual steps of the motion.
const TORN: f64 = 6.0;

/// Fewest runs of a sentinel.
const RUNS: usize = 2;

/// `sentinel` and `spike` of one column. An input may well stay at one value and jump; of a
/// `sensor` that is no motion.
pub(super) fn detect(
    recording: &Recording,
    name: &str,
    values: &[f64],
    sensor: bool,
) -> Option<Check> {
    let series = Series::of(values)?;
    let found = far_value(&series, sensor).or_else(|| dropouts(&series));
    if let Some((value, at)) = found {
        let value = written(value);
        let sentence = format!(
            "{value} stands in {} of {name}, far from everything around it, as loggers write for \
             \"no value\"",
            rows(at.len())
        );
        let remedy = format!("--missing {value}");
        return Some(Check::certain(
            recording, at[0], "sentinel", sentence, remedy,
        ));
    }
    let torn = || torn_runs(&series).or_else(|| recurring(&series));
    if let Some((value, at)) = sensor.then(torn).flatten() {
        let sentence = format!(
            "{value} stands in {} of {name}, where the motion jumps into it and out of it, as \
             drivers write for \"no value\"",
            rows(at.len())
        );
        let remedy = format!("--missing {name}={value}");
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

/// A number with all its digits, a large one by its power of ten.
fn written(value: f64) -> String {
    if value.abs() < 1e10 {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A value at one end of the range, far from all others, that recurs or is a round number: with
/// its rows.
fn far_value(series: &Series, sensor: bool) -> Option<(f64, Vec<usize>)> {
    // Two sentinels at both ends would hide each other.
    let others = || series.samples.iter().map(|s| s.1);
    let others = || others().filter(|y| !series.range.contains(y));
    let low = others().fold(f64::INFINITY, f64::min);
    let high = others().fold(f64::NEG_INFINITY, f64::max);
    let count = series.samples.len() as f64;
    let many = sensor && distinct(others().collect()) >= MANY.0;
    series.range.into_iter().find_map(|value| {
        let at: Vec<usize> = (series.samples.iter())
            .filter(|sample| sample.1 == value)
            .map(|sample| sample.0)
            .collect();
        let distance = (value - high).max(low - value);
        let round = value == value.round() && value.abs() >= 99.0;
        let part = at.len() as f64 / count;
        let very_far = many && round && distance > MANY.1 * (high - low);
        let few = part < PART || very_far && part < PART_OF_SENSOR;
        let far = high > low && distance > FAR * (high - low);
        (few && far && (round || at.len() >= 2)).then_some((value, at))
    })
}

/// Number of values that differ.
fn distinct(mut values: Vec<f64>) -> usize {
    order::sort(&mut values);
    values.dedup();
    values.len()
}

/// One exact value that a column of fine resolution has again and again, away from where the motion
/// is just before and just after: with its rows.
fn recurring(series: &Series) -> Option<(f64, Vec<usize>)> {
    let runs = series.runs();
    let mut values: Vec<f64> = runs.iter().map(|run| series.samples[run.0].1).collect();
    order::sort(&mut values);
    let groups = values.chunk_by(|a, b| a == b);
    let most = groups.max_by_key(|group| group.len())?;
    let (value, count) = (*most.first()?, most.len());
    let others: Vec<f64> = (series.samples.iter().map(|s| s.1))
        .filter(|y| *y != value)
        .collect();
    let fine = distinct(others.clone()) as f64 > FINE * others.len() as f64;
    let steps = series.samples.windows(2).map(|pair| [pair[0].1, pair[1].1]);
    let beside = steps.filter(|pair| !pair.contains(&value));
    let usual = quantile(beside.map(|[a, b]| (b - a).abs()), 0.98);
    let here = runs.iter().filter(|run| series.samples[run.0].1 == value);
    let torn = here.clone().filter(|run| {
        jumps(series, run).is_some_and(|[into, out_of]| {
            let onward = (out_of - into).abs() <= usual * (run.1 + 1) as f64;
            into * out_of > 0.0 && into.abs().min(out_of.abs()) > APART * usual && onward
        })
    });
    let torn = torn.count();
    let rows = here.flat_map(|run| run.0..run.0 + run.1);
    let rows: Vec<usize> = rows.map(|k| series.samples[k].0).collect();
    let few = 2 * rows.len() < series.samples.len();
    (fine && few && usual > 0.0 && torn >= RUNS && 4 * torn >= count).then_some((value, rows))
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

/// One exact value that a motion jumps to, stays at and jumps back from, to about where it would be
/// by then, again and again: with its rows. A motion that rests there comes to it and leaves it
/// slowly; one that passes through has no run of equal samples.
fn torn_runs(series: &Series) -> Option<(f64, Vec<usize>)> {
    let runs = series.runs();
    let value_of = |run: &(usize, usize)| series.samples[run.0].1;
    let value = most_jumped_to(series, &runs)?;
    let steps = series.samples.windows(2).map(|pair| [pair[0].1, pair[1].1]);
    let beside = steps.filter(|pair| !pair.contains(&value));
    let sizes = beside
        .map(|[a, b]| (b - a).abs())
        .filter(|size| *size > 0.0);
    let usual = quantile(sizes, 0.98);
    let is_torn = |run: &&(usize, usize)| {
        let jumps = jumps(series, run);
        jumps.is_some_and(|[into, out_of]| {
            let onward = (out_of - into).abs() <= usual * (run.1 + 1) as f64;
            into * out_of > 0.0 && into.abs().min(out_of.abs()) > TORN * usual && onward
        })
    };
    let here: Vec<&(usize, usize)> = runs.iter().filter(|run| value_of(run) == value).collect();
    let torn = here.iter().copied().filter(|run| is_torn(run));
    let torn: Vec<usize> = torn.map(|run| run.1).collect();
    let rows = here.iter().flat_map(|run| run.0..run.0 + run.1);
    let rows: Vec<usize> = rows.map(|k| series.samples[k].0).collect();
    let few = 2 * rows.len() < series.samples.len();
    let most = 2 * torn.iter().sum::<usize>() >= rows.len();
    (usual > 0.0 && few && most && torn.len() >= RUNS).then_some((value, rows))
}

/// Samples before and after a run, less its value; `None` at either end of the series.
fn jumps(series: &Series, &(first, length): &(usize, usize)) -> Option<[f64; 2]> {
    let value = series.samples[first].1;
    let before = series.samples[first.checked_sub(1)?].1;
    let after = series.samples.get(first + length)?.1;
    Some([before - value, after - value])
}

/// The value of the most runs that begin and end in a jump.
fn most_jumped_to(series: &Series, runs: &[(usize, usize)]) -> Option<f64> {
    let usual = quantile(sizes(&series.steps()), 0.5);
    let torn = runs.iter().filter(|run| {
        let jumps = jumps(series, run);
        run.1 >= 2 && jumps.is_some_and(|jumps| jumps.iter().all(|jump| jump.abs() > TORN * usual))
    });
    let mut values: Vec<f64> = torn.map(|run| series.samples[run.0].1).collect();
    order::sort(&mut values);
    let groups = values.chunk_by(|a, b| a == b);
    groups.max_by_key(|group| group.len()).map(|group| group[0])
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
