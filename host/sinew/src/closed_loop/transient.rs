//! Overshoot and settling time, of any reference that moves and rests
//! (docs/explanation/comparison.md, eq. 4).

use crate::closed_loop::scenario::{InputLimits, Run};

/// Steps for which a reference that does not change is a rest.
const REST: usize = 20;
/// Half width of the band that counts as settled, as a share of the move.
const BAND: f64 = 0.02;
/// A command this near to a limit, as a share of its range, is at it.
const NEAR: f64 = 1e-5;

/// Largest over all moves of one output; `None` where the reference never rests after a move.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Transient {
    /// Overshoot of the output, as a fraction of the move.
    pub overshoot: f64,
    /// Seconds from the reference's arrival until the error stays within 2 % of the move; null
    /// where it does not before the next move.
    pub settling_s: Option<f64>,
}

impl Transient {
    /// The larger of each.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let settling = self.settling_s.zip(other.settling_s);
        Self {
            overshoot: self.overshoot.max(other.overshoot),
            settling_s: settling.map(|(a, b)| a.max(b)),
        }
    }
}

impl Run {
    /// Overshoot and settling of output `i`. Who looks `lead` steps ahead leaves a rest as much
    /// earlier, which is neither.
    pub fn transient(&self, i: usize, period_s: f64, lead: usize) -> Option<Transient> {
        let r: Vec<f64> = self.reference.iter().map(|row| row[i]).collect();
        let mut worst: Option<Transient> = None;
        let mut before = *r.first()?;
        for (from, to) in rests(&r) {
            let target = r[from];
            let way = target - before;
            before = target;
            if way == 0.0 {
                continue;
            }
            let to = if to < r.len() {
                to.saturating_sub(lead).max(from + REST)
            } else {
                to
            };
            let rest = self.y[from..to].iter();
            let errors: Vec<f64> = rest.map(|y| (y[i] - target) / way).collect();
            let overshoot = errors.iter().copied().fold(0.0, f64::max);
            let outside = errors.iter().rposition(|e| e.abs() > BAND);
            let settling_s = match outside {
                None => Some(0.0),
                Some(last) if last + 1 < errors.len() => Some((last + 1) as f64 * period_s),
                Some(_) => None,
            };
            let this = Transient {
                overshoot,
                settling_s,
            };
            worst = Some(worst.map_or(this, |worst| worst.worse(this)));
        }
        worst
    }

    /// Seconds in which at least one command is at a limit or moves as fast as it may.
    pub fn at_limits_s(&self, limits: &[InputLimits], period_s: f64) -> f64 {
        let limited = (0..self.u.len()).filter(|k| {
            limits.iter().enumerate().any(|(c, (low, high, change))| {
                let (u, near) = (self.u[*k][c], NEAR * (high - low));
                let moved = k.checked_sub(1).map_or(0.0, |b| u - self.u[b][c]);
                u <= low + near || u >= high - near || moved.abs() >= change - near
            })
        });
        limited.count() as f64 * period_s
    }
}

/// Stretches over which the reference does not change.
fn rests(r: &[f64]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut from = 0;
    for k in 1..=r.len() {
        if k == r.len() || r[k] != r[from] {
            if k - from >= REST {
                found.push((from, k));
            }
            from = k;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A move from 0 to 2 that has arrived at step 30; the output passes it by `beyond` and comes
    /// back in 10 steps.
    fn run(beyond: f64, stays: bool) -> Run {
        let mut run = Run::default();
        for k in 0..100 {
            let r = if k < 30 { 0.0 } else { 2.0 };
            let e = if (30..40).contains(&k) || stays && k >= 30 {
                beyond
            } else {
                0.0
            };
            run.t.push(k as f64 * 0.1);
            run.reference.push(vec![r]);
            run.y.push(vec![r + e]);
            run.u.push(vec![if k < 5 { 1.0 } else { 0.0 }]);
        }
        run
    }

    #[test]
    fn overshoot_and_settling_are_those_of_the_move() {
        let found = run(0.5, false)
            .transient(0, 0.1, 0)
            .expect("the reference rests after a move");
        assert!((found.overshoot - 0.25).abs() < 1e-12);
        assert!((found.settling_s.expect("the response settles") - 1.0).abs() < 1e-12);
        let never = run(-0.5, true)
            .transient(0, 0.1, 0)
            .expect("the reference rests after a move");
        assert_eq!((never.overshoot, never.settling_s), (0.0, None));
    }

    #[test]
    fn who_leaves_early_for_the_next_move_has_not_overshot() {
        let mut early = run(0.0, false);
        for (k, row) in early.reference.iter_mut().enumerate() {
            if k >= 70 {
                row[0] = 4.0;
            }
            if k >= 66 {
                early.y[k][0] = 4.0;
            }
        }
        let of = |lead| early.transient(0, 0.1, lead).expect("the reference rests");
        assert!((of(3).overshoot - 1.0).abs() < 1e-12);
        assert_eq!((of(4).overshoot, of(4).settling_s), (0.0, Some(0.0)));
        // A rest is never shorter than what counts as one.
        assert_eq!(of(1000).overshoot, 0.0);
    }

    #[test]
    fn without_a_rest_after_a_move_there_is_nothing_to_say() {
        let mut moving = run(0.5, false);
        for (k, row) in moving.reference.iter_mut().enumerate() {
            row[0] = k as f64;
        }
        assert_eq!(moving.transient(0, 0.1, 0), None);
    }

    #[test]
    fn time_at_limits_counts_box_and_rate() {
        let limits = |change| [(-2.0, 1.0, change)];
        let run = run(0.0, false);
        assert!((run.at_limits_s(&limits(f64::INFINITY), 0.1) - 0.5).abs() < 1e-12);
        // The step down from 1 to 0 moves as fast as it may.
        assert!((run.at_limits_s(&limits(1.0), 0.1) - 0.6).abs() < 1e-12);
    }
}
