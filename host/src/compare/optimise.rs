//! One optimiser for every controller: Nelder-Mead on log-scaled gains from several starts, so that no
//! controller is compared at worse than its best.

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
    let search = |start: &Vec<f64>| -> (Vec<f64>, f64) {
        let origin: Vec<f64> = ranges.iter().zip(start).map(|(r, v)| r.place(*v)).collect();
        let mut simplex = vec![origin.clone()];
        for i in 0..origin.len() {
            let mut corner = origin.clone();
            corner[i] += if corner[i] < 0.5 { 0.15 } else { -0.15 };
            simplex.push(corner);
        }
        let problem = Problem {
            ranges,
            cost: &cost,
        };
        let run = Executor::new(problem, NelderMead::new(simplex))
            .configure(|state| state.max_iters(iterations))
            .run();
        // The solver fails only on an empty simplex; then the start itself stands.
        let Ok(result) = run else {
            return (start.clone(), f64::INFINITY);
        };
        let places = result.state().get_best_param().cloned().unwrap_or(origin);
        (values(ranges, &places), result.state().get_best_cost())
    };
    let found: Vec<(Vec<f64>, f64)> = starts.par_iter().map(search).collect();
    let unknown = (starts.first().cloned().unwrap_or_default(), f64::INFINITY);
    // In the order of the starts, so that equal costs do not depend on which search ended first.
    found.into_iter().fold(
        unknown,
        |best, next| if next.1 < best.1 { next } else { best },
    )
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
}
