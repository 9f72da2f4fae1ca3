//! Samples that repeat where the device moves: clipping, a frozen or dead sensor, coarse steps.

use super::finding::{Check, counted, number, rows};
use super::series::{Series, quantile, sizes};
use crate::noise::noise_level;
use crate::order;
use crate::recording::Recording;

/// Fewest equal samples of a plateau.
const PLATEAU: usize = 4;

/// Fewest equal samples of a sensor that froze, and of all plateaus together.
const FROZEN: usize = 20;

/// Fewest readings that can say anything of a device.
const FEWEST_READINGS: usize = 20;

/// Fewest rows in which a sensor without values says something.
const FEWEST_ROWS: usize = 20;

/// Fewest equal samples of a sensor that froze more than once.
const SHORT: usize = 6;

/// Longest run of equal samples of a sensor whose noise or motion its digits show.
const REPEATS: usize = 2;

/// Noise beside the range of a sensor from which on it is no rounding of a smooth motion.
const NOISY: f64 = 3e-4;

/// Most levels of a sensor whose steps are too coarse.
const LEVELS: usize = 40;

/// The first of `dead_channel`, `quantised`, `clipped`, `stuck_channel` in one column of a sensor;
/// `driven`: some input of the recording changes; `named`: a rig has this sensor.
pub(super) fn detect(
    recording: &Recording,
    name: &str,
    values: &[f64],
    (driven, named): (bool, bool),
) -> Option<Check> {
    if let Some(silent) = silent(recording, name, values, named) {
        return Some(silent);
    }
    let series = Series::of(values)?;
    if series.width() == 0.0 {
        return driven.then(|| dead(recording, name, &series));
    }
    coarse(recording, name, &series)
        .or_else(|| stuck(recording, name, &series))
        .or_else(|| clipped(recording, name, &series))
}

/// A sensor that gave next to nothing, in a recording that is long enough to tell.
fn silent(recording: &Recording, name: &str, values: &[f64], named: bool) -> Option<Check> {
    let valid = values.iter().filter(|value| value.is_finite()).count();
    if values.len() < FEWEST_ROWS || valid >= FEWEST_READINGS {
        return None;
    }
    let sentence = format!(
        "{name} has {} in {}",
        counted(valid, "value"),
        rows(values.len())
    );
    let remedy = "check the sensor and its cable; or leave the recording or the sensor out";
    let row = values.iter().position(|value| value.is_finite());
    let row = row.unwrap_or_default();
    let check = if named { Check::certain } else { Check::likely };
    Some(check(recording, row, "dead_channel", sentence, remedy))
}

fn dead(recording: &Recording, name: &str, series: &Series) -> Check {
    let sentence = format!(
        "{name} is {} in every row, while the input changes",
        number(series.range[0])
    );
    let remedy = "check the sensor and its cable; or leave the sensor out of the rig";
    let row = series.samples[0].0;
    Check::likely(recording, row, "dead_channel", sentence, remedy)
}

/// A sensor with few levels at equal distances.
fn coarse(recording: &Recording, name: &str, series: &Series) -> Option<Check> {
    let mut levels: Vec<f64> = series.samples.iter().map(|s| s.1).collect();
    order::sort(&mut levels);
    levels.dedup_by(|b, a| (*b - *a).abs() <= 1e-9 * series.width());
    if !(3..=LEVELS).contains(&levels.len()) || 4 * levels.len() > series.samples.len() {
        return None;
    }
    let gaps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step = quantile(gaps.iter().copied(), 0.0);
    let whole = gaps
        .iter()
        .filter(|gap| (*gap / step - (*gap / step).round()).abs() < 0.05)
        .count();
    if 20 * whole < 19 * gaps.len() {
        return None;
    }
    let sentence = format!(
        "{name} has {} only, {} apart, over its whole range",
        counted(levels.len(), "level"),
        number(step)
    );
    let remedy = "record more digits or a finer encoder; a motion below a step is not seen";
    let row = series.samples[0].0;
    Some(Check::likely(recording, row, "quantised", sentence, remedy))
}

/// Flat tops at one end of the range: runs of the highest or lowest value that the motion runs into
/// and leaves at speed, first sample and length of each. A motion that turns round slows down
/// before.
fn flat_tops(series: &Series, limit: f64) -> Vec<(usize, usize)> {
    let motion = Motion::of(series);
    let runs = series.runs().into_iter();
    let tops = runs
        .filter(|&(first, length)| length >= PLATEAU && series.samples[first].1 == limit)
        .filter(|&(first, length)| motion.is_cut(series, first, length));
    let tops: Vec<(usize, usize)> = tops.collect();
    let held: usize = tops.iter().map(|run| run.1).sum();
    if held < FROZEN { Vec::new() } else { tops }
}

/// A sensor that stays at an end of its range.
fn clipped(recording: &Recording, name: &str, series: &Series) -> Option<Check> {
    series.range.into_iter().find_map(|limit| {
        let tops = flat_tops(series, limit);
        let held: usize = tops.iter().map(|run| run.1).sum();
        let longest = tops.iter().map(|run| run.1).max()?;
        let row = series.samples[tops[0].0].0;
        let sentence = format!(
            "{name} stays at {}, an end of its range, in {}, {longest} in a row at most",
            number(limit),
            rows(held)
        );
        let remedy = "widen the sensor's range or move less; leave the flat rows empty until then";
        Some(Check::likely(recording, row, "clipped", sentence, remedy))
    })
}

/// Ends of the range of a sensor at which it is clipped.
pub(super) fn clipped_at(values: &[f64]) -> Vec<f64> {
    let Some(series) = Series::of(values) else {
        return Vec::new();
    };
    let ends = series.range.into_iter();
    ends.filter(|limit| !flat_tops(&series, *limit).is_empty())
        .collect()
}

/// Samples before and after a plateau over which the speed is taken.
const REACH: usize = 5;

/// Usual speed of a signal and its resolution.
struct Motion {
    /// Usual change over [`REACH`] samples.
    usual: f64,
    /// A small change from one sample to the next: an encoder's step.
    step: f64,
}

impl Motion {
    fn of(series: &Series) -> Self {
        let windows = series.samples.windows(REACH + 1);
        let changes: Vec<f64> = windows.map(|w| w[REACH].1 - w[0].1).collect();
        Self {
            usual: quantile(sizes(&changes), 0.5),
            step: quantile(sizes(&series.steps()), 0.05),
        }
    }

    /// The motion goes into and out of a run of equal samples faster than one that turns round
    /// within an encoder's step.
    fn is_cut(&self, series: &Series, first: usize, length: usize) -> bool {
        let (Some(before), last) = (first.checked_sub(REACH), first + length - 1 + REACH) else {
            return false;
        };
        let Some(after) = series.samples.get(last) else {
            return false;
        };
        let level = series.samples[first].1;
        let slower = [series.samples[before].1 - level, after.1 - level];
        let slower = slower
            .map(f64::abs)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        // A parabola that stays within a step for `length` samples leaves it so far in REACH more.
        let part = REACH as f64 / length as f64;
        let parabola = self.step * (1.0 + 4.0 * part + 4.0 * part * part);
        slower > 0.3 * self.usual && slower > 3.0 * parabola
    }
}

/// Length of the second longest run; 1 where there is none.
fn second_longest(runs: &[(usize, usize)]) -> usize {
    let [_, second] = runs.iter().fold([1, 1], |[first, second], &(_, length)| {
        [first.max(length), second.max(first.min(length))]
    });
    second
}

/// White noise of the samples before or behind a run, whichever are more.
fn noise_beside(recording: &Recording, series: &Series, (first, length): (usize, usize)) -> f64 {
    let (before, after) = (&series.samples[..first], &series.samples[first + length..]);
    let more = if before.len() < after.len() {
        after
    } else {
        before
    };
    let samples = more.iter().map(|&(row, value)| (recording.t()[row], value));
    let (t, values): (Vec<f64>, Vec<f64>) = samples.unzip();
    noise_level(&t, &values)
}

/// A run of one value that begins in motion and ends in a jump, or longer than any other by far and
/// without end.
fn stuck(recording: &Recording, name: &str, series: &Series) -> Option<Check> {
    let steps = series.steps();
    let runs = series.runs();
    let fast = quantile(sizes(&steps), 0.98);
    let usual = quantile(sizes(&steps), 0.5);
    let speed = sinew_sim::unit::of_column(name).ends_with("/s");
    let second = second_longest(&runs);
    // Where no sample else repeats, noise or motion goes on up to the run and from it.
    let alive = |steps: &[f64]| {
        second <= REPEATS && quantile(steps.iter().map(|step| step.abs()), 0.5) > 0.5 * usual
    };
    let frozen = |&(first, length): &(usize, usize)| {
        // A velocity of zero is rest.
        let rest = speed && series.samples[first].1 == 0.0;
        let into = first.checked_sub(1).map_or(0.0, |k| steps[k].abs());
        let ends = match steps.get(first + length - 1) {
            Some(jump) => jump.abs() > 3.0 * fast,
            None => into > usual && length > 4 * second,
        };
        let after = steps.get(first + length..(first + length + REACH).min(steps.len()));
        let before = &steps[first.saturating_sub(REACH + 1)..first.saturating_sub(1)];
        let at_end = first > REACH && first + length == series.samples.len() && alive(before);
        let at_begin = first == 0 && series.samples[0].1 != 0.0 && after.is_some_and(alive);
        let within = into > 0.3 * usual && ends;
        // A sensor whose noise shows in every other sample cannot rest to the digit, but at an end
        // of its range.
        let noisy = || {
            second <= REPEATS
                && !series.range.contains(&series.samples[first].1)
                && noise_beside(recording, series, (first, length)) > NOISY * series.width()
        };
        let long = length >= FROZEN && (at_end || at_begin || noisy());
        length >= SHORT && !rest && (within || long)
    };
    let all: Vec<&(usize, usize)> = runs.iter().filter(|run| frozen(run)).collect();
    let &(first, longest) = all.iter().find(|run| run.1 >= FROZEN).or(all.first())?;
    let together: usize = all.iter().map(|run| run.1).sum();
    if together < FROZEN {
        return None;
    }
    let row = series.samples[*first].0;
    let sentence = match all.len() {
        1 => format!(
            "{name} stays at {} for {} while the device moves before or after",
            number(series.samples[*first].1),
            rows(*longest)
        ),
        count => format!(
            "{name} stays where it is {count} times, for {} together, while the device moves \
             before or after",
            rows(together)
        ),
    };
    let remedy = "leave these fields empty, or cut the recording there";
    Some(Check::likely(
        recording,
        row,
        "stuck_channel",
        sentence,
        remedy,
    ))
}
