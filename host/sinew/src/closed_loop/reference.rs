//! References: recorded ones, the published staircase, and moves that only tuning sees.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Reference of each output, one row a control period; the last row is held afterwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// `rows[k][output]`, physical units; row 0 is the present at step 0.
    pub rows: Vec<Vec<f64>>,
}

/// Workspace of an output and its usual speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace {
    /// Lowest position recorded.
    pub low: f64,
    /// Highest position recorded.
    pub high: f64,
    /// A speed that the rig reaches with ease, per second.
    pub speed: f64,
}

impl Reference {
    /// Row `k`, the last one held.
    pub fn row(&self, k: usize) -> &[f64] {
        match self.rows.get(k).or(self.rows.last()) {
            Some(row) => row,
            None => &[],
        }
    }

    /// Number of control steps: a command is computed for every row but the last.
    pub fn steps(&self) -> usize {
        self.rows.len().saturating_sub(1)
    }

    /// Columns of a recording, linear between its samples, read every `period` seconds from its
    /// first to its last time.
    pub fn recorded(t: &[f64], columns: &[&[f64]], period: f64) -> Self {
        let (Some(first), Some(last)) = (t.first(), t.last()) else {
            return Self { rows: Vec::new() };
        };
        let count = ((last - first) / period + 1e-6) as usize + 1;
        let rows = (0..count).map(|k| {
            let at = first + k as f64 * period;
            columns
                .iter()
                .map(|column| interpolate(t, column, at))
                .collect()
        });
        Self {
            rows: rows.collect(),
        }
    }

    /// From `low` to 0.2, 0.4 and 0.8 of the way to `high`, the levels of the published staircase,
    /// `each` steps a level; every move is minimum-jerk at the workspace's speed, since a jump
    /// measures little but the actuator's limits.
    pub fn staircase(workspaces: &[Workspace], each: usize, period: f64) -> Self {
        let columns = workspaces.iter().map(|w| {
            let mut column = vec![w.low];
            for level in [0.2, 0.4, 0.8] {
                let end = column.len() + each;
                let (from, to) = (column[column.len() - 1], w.low + level * (w.high - w.low));
                append_move(&mut column, from, to, w.speed, period, each);
                column.resize(end, to);
            }
            column
        });
        Self::of_columns(&columns.collect::<Vec<_>>())
    }

    /// Random minimum-jerk moves with rests, from `home` where an output has one: for tuning and
    /// for loops beside the reported one.
    pub fn moves(
        workspaces: &[Workspace],
        home: &[Option<f64>],
        steps: usize,
        period: f64,
        seed: u64,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let columns = workspaces.iter().zip(home).map(|(w, home)| {
            let mut place = || w.low + (w.high - w.low) * random.random_range(0.1..0.9);
            let somewhere = place();
            let mut column = vec![home.unwrap_or(somewhere)];
            while column.len() <= steps {
                let (from, to) = (column[column.len() - 1], place());
                append_move(&mut column, from, to, w.speed, period, steps);
                let rested = column.len() + (steps / 16).max(1);
                column.resize(rested, to);
            }
            column.truncate(steps + 1);
            column
        });
        Self::of_columns(&columns.collect::<Vec<_>>())
    }

    /// As demanding as this one and another: backwards in time and upside down, `steps` of it from
    /// the `part`-th stretch on. For tuning.
    pub fn mirrored(&self, steps: usize, part: usize) -> Self {
        let columns = self.rows.first().map_or(0, Vec::len);
        let turned: Vec<f64> = (0..columns)
            .map(|i| {
                let ends = self
                    .rows
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), row| {
                        (low.min(row[i]), high.max(row[i]))
                    });
                ends.0 + ends.1
            })
            .collect();
        let mirrored = self.rows.iter().rev().map(|row| {
            row.iter()
                .zip(&turned)
                .map(|(r, sum)| sum - r)
                .collect::<Vec<f64>>()
        });
        let first = (part * steps) % self.rows.len().saturating_sub(steps).max(1);
        Self {
            rows: mirrored.skip(first).take(steps + 1).collect(),
        }
    }

    /// The first `steps` of this one driven backwards. For tuning, where a path's outputs belong
    /// together: turned upside down one by one, they would lead where the plant cannot go.
    pub fn backwards(&self, steps: usize) -> Self {
        Self {
            rows: self.rows.iter().rev().take(steps + 1).cloned().collect(),
        }
    }

    fn of_columns(columns: &[Vec<f64>]) -> Self {
        let rows = columns.first().map_or(0, Vec::len);
        Self {
            rows: (0..rows)
                .map(|k| columns.iter().map(|c| c[k]).collect())
                .collect(),
        }
    }
}

/// A minimum-jerk move (Flash and Hogan 1985) whose mean speed is at most `speed`, unless `most`
/// steps do not suffice for that.
fn append_move(column: &mut Vec<f64>, from: f64, to: f64, speed: f64, period: f64, most: usize) {
    let steps = ((to - from).abs() / speed.max(1e-12) / period)
        .ceil()
        .clamp(1.0, most as f64) as usize;
    column.extend((1..=steps).map(|k| {
        let s = k as f64 / steps as f64;
        from + (to - from) * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    }));
}

/// Linear between the samples around `at`; missing samples are predicted, ends are held.
fn interpolate(t: &[f64], values: &[f64], at: f64) -> f64 {
    let next = t.partition_point(|x| *x < at);
    let after = (next..t.len()).find(|i| values[*i].is_finite());
    let before = (0..next).rev().find(|i| values[*i].is_finite());
    match (before, after) {
        (Some(a), Some(b)) => values[a] + (values[b] - values[a]) * (at - t[a]) / (t[b] - t[a]),
        (Some(i), None) | (None, Some(i)) => values[i],
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recorded_reference_is_linear_between_samples_and_bridges_missing_ones() {
        let t = [0.0, 0.1, 0.2, 0.4];
        let r = [0.0, 1.0, f64::NAN, 4.0];
        let reference = Reference::recorded(&t, &[&r], 0.05);
        let rows: Vec<f64> = reference.rows.iter().map(|r| r[0]).collect();
        let expected = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0];
        assert_eq!(rows.len(), expected.len());
        assert!(
            rows.iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-12),
            "{rows:?}"
        );
        assert_eq!(reference.row(100), [4.0]);
    }

    #[test]
    fn moves_stay_in_the_workspace_and_differ_by_seed() {
        let workspace = [Workspace {
            low: -1.0,
            high: 3.0,
            speed: 2.0,
        }];
        let a = Reference::moves(&workspace, &[None], 500, 0.01, 1);
        let b = Reference::moves(&workspace, &[Some(0.5)], 500, 0.01, 2);
        assert_ne!(a, b);
        assert_eq!(b.row(0), [0.5]);
        assert_eq!(a.rows.len(), 501);
        assert!(a.rows.iter().all(|r| r[0] >= -1.0 && r[0] <= 3.0));
    }

    #[test]
    fn a_mirrored_reference_is_another_with_the_same_speeds() {
        let rows = [0.0, 1.0, 3.0, 3.5, 2.0].map(|r| vec![r]).to_vec();
        let mirrored = Reference { rows }.mirrored(4, 0);
        let found: Vec<f64> = mirrored.rows.iter().map(|r| r[0]).collect();
        assert_eq!(found, [1.5, 0.0, 0.5, 2.5, 3.5]);
    }

    #[test]
    fn a_path_backwards_passes_the_same_places() {
        let rows: Vec<Vec<f64>> = (0..5)
            .map(|k| vec![f64::from(k), f64::from(k * k)])
            .collect();
        let turned = Reference { rows }.backwards(2);
        assert_eq!(turned.rows, [[4.0, 16.0], [3.0, 9.0], [2.0, 4.0]]);
    }

    #[test]
    fn the_staircase_has_999_steps_and_never_jumps() {
        let workspace = [Workspace {
            low: 1.0,
            high: 2.0,
            speed: 0.5,
        }];
        let reference = Reference::staircase(&workspace, 333, 0.01);
        assert_eq!(reference.steps(), 999);
        let levels = [0, 333, 666, 999].map(|k| reference.row(k)[0]);
        assert!(
            levels
                .iter()
                .zip([1.0, 1.2, 1.4, 1.8])
                .all(|(a, b)| (a - b).abs() < 1e-12),
            "{levels:?}"
        );
        // Mean speed 0.5 makes a peak of 15/8 of that.
        let fastest = reference
            .rows
            .windows(2)
            .map(|w| (w[1][0] - w[0][0]).abs())
            .fold(0.0, f64::max);
        assert!(
            (0.5 * 0.01..=0.5 * 0.01 * 1.9).contains(&fastest),
            "{fastest}"
        );
    }
}
