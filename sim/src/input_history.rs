//! History of the inputs before the first row (docs/explanation/plant.md, "Inputs"): a part of a
//! recording begins with delays, plays and lags where the recording left them.

/// Rows before the first that the stages go through one by one.
const ROWS: usize = 64;

/// The past of all inputs.
#[derive(Clone, Debug, Default)]
pub(crate) struct InputHistory {
    /// When the last of its rows were, in seconds from the first row of the drive on: below zero,
    /// ascending.
    pub(crate) times: Vec<f64>,
    /// Each input in these rows.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Each input before these rows: its first value, then what no later value outdoes, oldest
    /// first.
    pub(crate) extremes: Vec<Vec<f64>>,
}

impl InputHistory {
    /// From rows at `times`, `now` being that of the drive's first.
    pub(crate) fn new(times: &[f64], now: f64, columns: &[&[f64]]) -> Self {
        let first = times.len().saturating_sub(ROWS);
        Self {
            times: times[first..].iter().map(|t| t - now).collect(),
            columns: columns.iter().map(|c| c[first..].to_vec()).collect(),
            extremes: columns.iter().map(|c| extremes(&c[..first])).collect(),
        }
    }

    /// An input at a time before the first row, or before all times, with its slope; `next` is the
    /// input at the first row. `None` where there is no past or the time is not before the first
    /// row.
    pub(crate) fn sampled(&self, input: usize, time: f64, next: f64) -> Option<(f64, f64)> {
        let row = self.times.partition_point(|&t| t < time);
        let there = row < self.times.len();
        there.then(|| self.at(row, input, next))
    }

    /// An input at one of [`InputHistory::times`], with its slope to the row after; `next` is the
    /// drive's own first value.
    pub(crate) fn at(&self, row: usize, input: usize, next: f64) -> (f64, f64) {
        let column = &self.columns[input];
        let (after, until) = match column.get(row + 1) {
            Some(&after) => (after, self.times[row + 1]),
            None => (next, 0.0),
        };
        (
            column[row],
            (after - column[row]) / (until - self.times[row]),
        )
    }
}

/// A play of any gap ends after these values where it ends after the whole column (Brokate and
/// Sprekels, Hysteresis and phase transitions, 1996, 2.2): the turns that, going back from the end,
/// reach beyond all that came later. They alternate.
fn extremes(column: &[f64]) -> Vec<f64> {
    let Some((&last, before)) = column.split_last() else {
        return Vec::new();
    };
    let mut turns = vec![last];
    let (mut low, mut high) = (last, last);
    for &value in before.iter().rev() {
        let beyond = match (value > high, value < low) {
            (true, _) => &mut high,
            (_, true) => &mut low,
            _ => continue,
        };
        // On the same side as the turn before, it takes its place.
        if turns.len() > 1 && turns.last() == Some(beyond) {
            turns.pop();
        }
        *beyond = value;
        turns.push(value);
    }
    // Where the play began.
    turns.extend(before.first());
    turns.reverse();
    turns
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::extremes;

    /// Eq. 14f, from nothing.
    fn played(column: &[f64], half: f64) -> f64 {
        let mut output = 0.0;
        for value in column {
            output = f64::min(f64::max(output, value - half), value + half);
        }
        output
    }

    proptest! {
        #[test]
        fn extremes_leave_a_play_where_the_whole_column_does(
            column in prop::collection::vec(-1.0..1.0f64, 0..60), half in 0.0..1.5f64,
        ) {
            let few = extremes(&column);
            prop_assert_eq!(played(&few, half), played(&column, half));
        }
    }

    #[test]
    fn a_long_column_has_few_extremes() {
        let swinging: Vec<f64> = (0..100_000)
            .map(|k| (0.618 * f64::from(k)).fract())
            .collect();
        assert!(extremes(&swinging).len() < 100);
        let falling: Vec<f64> = (0..1000).map(|k| -f64::from(k)).collect();
        assert_eq!(extremes(&falling), [0.0, 0.0, -999.0]);
    }
}
