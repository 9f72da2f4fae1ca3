//! One optimiser for every controller: Nelder-Mead on log-scaled gains from several starts, so that no
//! controller is compared at worse than its best.

use std::sync::atomic::{AtomicUsize, Ordering};

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;
use rayon::prelude::*;

/// Range of one gain; it is searched on a logarithmic scale, or on a linear one where it may be zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Logarithmic scale; `low` must then be positive.
    pub logarithmic: bool,
}

impl Range {
    /// Logarithmic between two positive values.
    pub const fn logarithmic(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: true,
        }
    }

    /// Linear between two values.
    pub const fn linear(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: false,
        }
    }

    /// The value at `s` in 0..1; outside, the nearer end.
    pub fn at(&self, s: f64) -> f64 {
        let s = s.clamp(0.0, 1.0);
        if self.logarithmic {
            (self.low.ln() + s * (self.high.ln() - self.low.ln())).exp()
        } else {
            self.low + s * (self.high - self.low)
        }
    }

    /// The place in 0..1 of a value.
    pub fn place(&self, value: f64) -> f64 {
        let s = if self.logarithmic {
            (value.max(self.low).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        s.clamp(0.0, 1.0)
    }
}

struct Problem<'a> {
    ranges: &'a [Range],
    cost: &'a (dyn Fn(&[f64]) -> f64 + Sync),
}

impl CostFunction for Problem<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, places: &Self::Param) -> Result<f64, argmin::core::Error> {
        // A place outside its range costs as its nearer end and a little more, so that the simplex
        // comes back.
        let outside: f64 = places.iter().map(|s| (s - s.clamp(0.0, 1.0)).abs()).sum();
        let values = values(self.ranges, places);
        let cost = (self.cost)(&values);
        Ok(if cost.is_finite() {
            cost * (1.0 + outside)
        } else {
            f64::MAX
        })
    }
}

fn values(ranges: &[Range], places: &[f64]) -> Vec<f64> {
    ranges.iter().zip(places).map(|(r, s)| r.at(*s)).collect()
}

/// The cheapest gains found and their cost: `iterations` of Nelder-Mead from each of `starts`.
///
/// Deterministic: nothing is drawn. A cost that is not finite counts as the worst there is.
pub fn minimise(
    ranges: &[Range],
    starts: &[Vec<f64>],
    iterations: u64,
    cost: impl Fn(&[f64]) -> f64 + Sync,
) -> (Vec<f64>, f64) {
    let from = |start: &Vec<f64>| simplex(ranges, start, iterations, &cost);
    let found: Vec<(Vec<f64>, f64)> = starts.par_iter().map(from).collect();
    let unknown = (starts.first().cloned().unwrap_or_default(), f64::INFINITY);
    // In the order of the starts, so that equal costs do not depend on which search ended first.
    found.into_iter().fold(
        unknown,
        |best, next| if next.1 < best.1 { next } else { best },
    )
}

/// Nelder-Mead from one start.
fn simplex(
    ranges: &[Range],
    start: &[f64],
    iterations: u64,
    cost: &(dyn Fn(&[f64]) -> f64 + Sync),
) -> (Vec<f64>, f64) {
    let origin: Vec<f64> = ranges.iter().zip(start).map(|(r, v)| r.place(*v)).collect();
    let mut simplex = vec![origin.clone()];
    for i in 0..origin.len() {
        let mut corner = origin.clone();
        corner[i] += if corner[i] < 0.5 { 0.15 } else { -0.15 };
        simplex.push(corner);
    }
    let run = Executor::new(Problem { ranges, cost }, NelderMead::new(simplex))
        .configure(|state| state.max_iters(iterations))
        .run();
    // The solver fails only on an empty simplex; then the start itself stands.
    let Ok(result) = run else {
        return (start.to_vec(), f64::INFINITY);
    };
    let places = result.state().get_best_param().cloned().unwrap_or(origin);
    (values(ranges, &places), result.state().get_best_cost())
}

/// What a search may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// Iterations from every start, and again from the best of what they found.
    Thorough(u64, u64),
    /// Evaluations in all: every start once, two thirds of the others from the cheapest start, the rest
    /// from what that found.
    Evaluations(usize),
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The cheapest start.
    pub start: Vec<f64>,
    /// Its cost.
    pub start_cost: f64,
    /// The cheapest settings.
    pub best: Vec<f64>,
    /// Their cost.
    pub cost: f64,
    /// Evaluations that were made.
    pub evaluations: usize,
}

/// Searches within a budget; a simplex shrinks along valleys, so a second one begins where the first ended.
/// Deterministic, as [`minimise`].
pub fn search(
    ranges: &[Range],
    starts: &[Vec<f64>],
    budget: Budget,
    cost: impl Fn(&[f64]) -> f64 + Sync,
) -> Found {
    let made = AtomicUsize::new(0);
    let counted = |g: &[f64]| {
        made.fetch_add(1, Ordering::Relaxed);
        cost(g)
    };
    let of_starts: Vec<f64> = starts.par_iter().map(|start| counted(start)).collect();
    let unknown = (starts.first().cloned().unwrap_or_default(), f64::INFINITY);
    let start = starts
        .iter()
        .cloned()
        .zip(of_starts)
        .fold(
            unknown,
            |best, next| if next.1 < best.1 { next } else { best },
        );
    let better = |a: (Vec<f64>, f64), b: (Vec<f64>, f64)| if b.1 < a.1 { b } else { a };
    let best = match budget {
        Budget::Thorough(each, again) => {
            let first = minimise(ranges, starts, each, counted);
            minimise(ranges, &[first.0], again, counted)
        }
        Budget::Evaluations(all) => {
            let mut best = start.clone();
            for share in [2 * all / 3, all] {
                // Beyond its share a simplex sees walls; it runs idle until its iterations are over.
                let within = |g: &[f64]| {
                    if made.load(Ordering::Relaxed) < share {
                        counted(g)
                    } else {
                        f64::INFINITY
                    }
                };
                let found = simplex(ranges, &best.0, all as u64, &within);
                best = better(best, found);
            }
            best
        }
    };
    let (best, cost) = better(start.clone(), best);
    Found {
        start: start.0,
        start_cost: start.1,
        best,
        cost,
        evaluations: made.into_inner(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_minimum_over_scales_and_keeps_inside_ranges() {
        let ranges = [Range::logarithmic(1e-4, 1e4), Range::linear(0.0, 1.0)];
        let cost = |v: &[f64]| (v[0].ln() - 3.0_f64.ln()).powi(2) + (v[1] - 2.0).powi(2);
        let (found, at) = minimise(&ranges, &[vec![1e-2, 0.2], vec![1e2, 0.5]], 120, cost);
        assert!((found[0] - 3.0).abs() < 0.05, "{found:?}");
        assert!((found[1] - 1.0).abs() < 1e-3, "{found:?}");
        assert!(at < 1.01);
    }

    #[test]
    fn a_cost_without_a_value_is_never_chosen() {
        let ranges = [Range::linear(0.0, 1.0)];
        let cost = |v: &[f64]| if v[0] < 0.4 { f64::NAN } else { v[0] };
        let (found, _) = minimise(&ranges, &[vec![0.9]], 80, cost);
        assert!((found[0] - 0.4).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_budget_of_evaluations_is_kept_and_never_loses_the_start() {
        let ranges = [Range::logarithmic(1e-4, 1e4), Range::linear(0.0, 1.0)];
        let cost = |v: &[f64]| (v[0].ln() - 3.0_f64.ln()).powi(2) + (v[1] - 0.4).powi(2);
        let starts = [vec![1e-2, 0.2], vec![1e2, 0.5]];
        let found = search(&ranges, &starts, Budget::Evaluations(90), cost);
        assert_eq!(found.start, starts[1]);
        assert!(
            (60..=90).contains(&found.evaluations),
            "{}",
            found.evaluations
        );
        assert!((found.best[0] / 3.0 - 1.0).abs() < 0.05, "{found:?}");
        assert!(found.cost < 0.01 * found.start_cost);
        let none = search(&ranges, &starts, Budget::Evaluations(1), cost);
        assert_eq!((none.best, none.cost), (none.start, none.start_cost));
    }
}
