//! One optimiser for every controller: Nelder-Mead on log-scaled gains from several starts, so that
//! no controller is compared at worse than its best.

use std::sync::atomic::{AtomicUsize, Ordering};

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;
use rayon::prelude::*;

use sinew_search::Population;

/// Range of one gain; it is searched on a logarithmic scale, or on a linear one where it may be
/// zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Logarithmic scale; `low` must then be positive.
    pub logarithmic: bool,
    /// Rounded to whole numbers, such as steps.
    pub whole: bool,
}

impl Range {
    /// Logarithmic between two positive values.
    pub const fn logarithmic(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: true,
            whole: false,
        }
    }

    /// Linear between two values.
    pub const fn linear(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: false,
            whole: false,
        }
    }

    /// Whole numbers between two of them.
    pub const fn whole(low: f64, high: f64) -> Self {
        Self {
            whole: true,
            ..Self::linear(low, high)
        }
    }

    /// The value at `s` in 0..1; outside, the nearer end.
    pub fn at(&self, s: f64) -> f64 {
        let s = s.clamp(0.0, 1.0);
        if self.logarithmic {
            (self.low.ln() + s * (self.high.ln() - self.low.ln())).exp()
        } else {
            let value = self.low + s * (self.high - self.low);
            if self.whole { value.round() } else { value }
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
        Ok(judged(self.ranges, places, self.cost))
    }
}

/// Cost of a place. One outside its range costs as its nearer end and a little more, so that a
/// search comes back.
fn judged(ranges: &[Range], places: &[f64], cost: impl Fn(&[f64]) -> f64) -> f64 {
    let outside: f64 = places.iter().map(|s| (s - s.clamp(0.0, 1.0)).abs()).sum();
    let cost = cost(&values(ranges, places));
    if cost.is_finite() {
        cost * (1.0 + outside)
    } else {
        f64::MAX
    }
}

fn values(ranges: &[Range], places: &[f64]) -> Vec<f64> {
    ranges.iter().zip(places).map(|(r, s)| r.at(*s)).collect()
}

fn places(ranges: &[Range], values: &[f64]) -> Vec<f64> {
    ranges
        .iter()
        .zip(values)
        .map(|(r, v)| r.place(*v))
        .collect()
}

/// Least spread of a population: one that is drawn between two whole numbers takes both.
fn least(ranges: &[Range]) -> Vec<f64> {
    let spread = |range: &Range| {
        if range.whole {
            0.3 / (range.high - range.low).max(1.0)
        } else {
            0.0
        }
    };
    ranges.iter().map(spread).collect()
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
    let origin = places(ranges, start);
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

/// Budget of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// Iterations from every start, and again from the best of what they found and its neighbours.
    Thorough(u64, u64),
    /// Evaluations in all: every start once, as far as they go, two thirds of the others from the
    /// cheapest start, the rest from what that found and its neighbours.
    Evaluations(usize),
    /// Evaluations in all: every start once, as far as they go, half of the others shared by the
    /// cheapest starts that lie apart, the rest as of [`Budget::Evaluations`] from the cheapest
    /// that these found. For costs with several valleys: the cheapest start of a PID may be the
    /// bang-bang that it ends as.
    Apart(usize),
    /// Evaluations in all, and a seed: as [`Budget::Apart`], but a population around what the
    /// starts gave has half of the rest.
    Population(usize, u64),
}

/// Starts that share a budget.
const TRIED: usize = 3;
/// Spread of a population around what these found, as a fraction of the searched range.
const SPREAD: f64 = 0.1;
/// Least distance between them, as a fraction of the searched range.
const APART: f64 = 0.3;

/// Result of a search.
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

/// A point, and those one step aside in a whole setting: on plateaus a simplex does not leave its
/// step.
fn neighbours(ranges: &[Range], point: &[f64]) -> Vec<Vec<f64>> {
    let mut all = vec![point.to_vec()];
    for (i, range) in ranges.iter().enumerate().filter(|(_, range)| range.whole) {
        for value in [point[i] + 1.0, point[i] - 1.0] {
            if (range.low..=range.high).contains(&value) {
                let mut aside = point.to_vec();
                aside[i] = value;
                all.push(aside);
            }
        }
    }
    all
}

/// The cheapest starts that lie apart, cheapest first.
fn apart(ranges: &[Range], starts: &[Vec<f64>], costs: &[f64]) -> Vec<Vec<f64>> {
    let distance = |a: &[f64], b: &[f64]| {
        let places = ranges.iter().zip(a.iter().zip(b));
        let squares = places.map(|(range, (a, b))| (range.place(*a) - range.place(*b)).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let mut order: Vec<usize> = (0..starts.len()).collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    let mut chosen: Vec<Vec<f64>> = vec![];
    for start in order.into_iter().map(|i| &starts[i]) {
        if chosen.len() < TRIED && chosen.iter().all(|c| distance(c, start) >= APART) {
            chosen.push(start.clone());
        }
    }
    chosen
}

/// Searches within a budget; a simplex shrinks along valleys, so others begin where the first
/// ended. Deterministic, as [`minimise`].
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
    let starts = match budget {
        Budget::Evaluations(all) | Budget::Apart(all) | Budget::Population(all, _) => {
            &starts[..starts.len().min(all.max(1))]
        }
        Budget::Thorough(..) => starts,
    };
    let of_starts: Vec<f64> = starts.par_iter().map(|start| counted(start)).collect();
    let unknown = (starts.first().cloned().unwrap_or_default(), f64::INFINITY);
    let start =
        starts
            .iter()
            .cloned()
            .zip(of_starts.iter().copied())
            .fold(
                unknown,
                |best, next| if next.1 < best.1 { next } else { best },
            );
    let better = |a: (Vec<f64>, f64), b: (Vec<f64>, f64)| if b.1 < a.1 { b } else { a };
    let best = match budget {
        Budget::Thorough(each, again) => {
            let first = minimise(ranges, starts, each, counted);
            minimise(ranges, &neighbours(ranges, &first.0), again, counted)
        }
        Budget::Evaluations(all) | Budget::Apart(all) | Budget::Population(all, _) => {
            let within = |from: &[f64], share: usize| {
                // Beyond its share a simplex sees walls; it runs idle until its iterations are
                // over.
                let cost = |g: &[f64]| {
                    if made.load(Ordering::Relaxed) < share {
                        counted(g)
                    } else {
                        f64::INFINITY
                    }
                };
                simplex(ranges, from, all as u64, &cost)
            };
            // From each point in turn: equal shares of the evaluations with these numbers.
            let in_turn = |from: &[Vec<f64>], share: std::ops::Range<usize>, best| {
                let until = |i| share.start + share.len() * (i + 1) / from.len();
                let ends = from.iter().enumerate();
                ends.fold(best, |best, (i, point)| {
                    better(best, within(point, until(i)))
                })
            };
            let mut best = start.clone();
            let mut alone = 0;
            if matches!(budget, Budget::Apart(_) | Budget::Population(..)) {
                let half = starts.len() + all.saturating_sub(starts.len()) / 2;
                let tried = apart(ranges, starts, &of_starts);
                best = in_turn(&tried, starts.len()..half, best);
                alone = half;
            }
            if let Budget::Population(_, seed) = budget {
                let population = Population {
                    evaluations: all.saturating_sub(alone) / 2,
                    spread: SPREAD,
                    seed,
                    least: &least(ranges),
                };
                alone += population.evaluations;
                let known = [(places(ranges, &best.0), best.1)];
                let found = population.search(&known, |at| judged(ranges, at, counted));
                best = better(best, (values(ranges, &found.0), found.1));
            }
            let first = alone + 2 * all.saturating_sub(alone) / 3;
            best = in_turn(&[best.0.clone()], alone..first, best);
            in_turn(&neighbours(ranges, &best.0), first..all, best)
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
    fn a_whole_setting_is_searched_beyond_its_plateau() {
        let ranges = [Range::linear(0.0, 1.0), Range::whole(0.0, 12.0)];
        // A valley that bends where the whole setting steps: from 2, no small change leads to 3.
        let cost = |v: &[f64]| {
            assert_eq!(v[1], v[1].round());
            (v[1] - 3.0).powi(2) + 50.0 * (v[0] - 0.1 * v[1]).powi(2)
        };
        let from = |budget| search(&ranges, &[vec![0.9, 1.0]], budget, cost).best;
        let searched = [
            Budget::Thorough(60, 60),
            Budget::Evaluations(200),
            Budget::Population(200, 1),
        ];
        for budget in searched {
            let best = from(budget);
            assert_eq!(best[1], 3.0, "{budget:?}");
            assert!((best[0] - 0.3).abs() < 1e-3, "{budget:?}: {best:?}");
        }
    }

    #[test]
    fn a_budget_that_starts_apart_finds_the_valley_beside_the_cheapest_start() {
        let ranges = [Range::linear(0.0, 1.0), Range::linear(0.0, 1.0)];
        // A broad valley of cost 1 around 0.9, and a deep one around 0.2 whose wall is higher than
        // that.
        let cost = |v: &[f64]| {
            let to = |x: f64| ((v[0] - x).powi(2) + (v[1] - x).powi(2)).sqrt();
            (1.0 + to(0.9)).min(10.0 * to(0.2))
        };
        let starts = [vec![0.8, 0.8], vec![0.85, 0.8], vec![0.1, 0.3]];
        let found = |budget| search(&ranges, &starts, budget, cost);
        assert_eq!(found(Budget::Evaluations(120)).start, starts[1]);
        assert!(found(Budget::Evaluations(120)).cost > 0.99);
        let apart = found(Budget::Apart(120));
        assert!(apart.cost < 0.05, "{apart:?}");
        assert!((100..=120).contains(&apart.evaluations), "{apart:?}");
        let population = found(Budget::Population(120, 1));
        assert!(population.cost < 0.05, "{population:?}");
        assert!((100..=120).contains(&population.evaluations));
    }

    /// A cost that counts has no slope: the simplex stays on its plateau.
    #[test]
    fn a_population_goes_on_where_a_cost_only_counts() {
        let ranges = [Range::linear(0.0, 1.0); 4];
        let cost = |v: &[f64]| -> f64 {
            let whole = (0..4).map(|i| {
                let along = v[i] - 0.4 + 0.5 * (v[(i + 1) % 4] - 0.4);
                (6.0 * along.abs()).floor()
            });
            whole.sum()
        };
        let starts = [vec![0.9; 4], vec![0.1, 0.9, 0.1, 0.9]];
        let simplex = search(&ranges, &starts, Budget::Apart(400), cost).cost;
        let populations = [1, 2, 3, 4, 5]
            .map(|seed| search(&ranges, &starts, Budget::Population(400, seed), cost));
        let better = populations.iter().filter(|found| found.cost < simplex);
        let costs: Vec<f64> = populations.iter().map(|found| found.cost).collect();
        assert!(better.count() >= 4, "{simplex}: {costs:?}");
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
        for budget in [
            Budget::Evaluations(1),
            Budget::Apart(1),
            Budget::Population(1, 1),
        ] {
            let none = search(&ranges, &starts, budget, cost);
            assert_eq!(none.evaluations, 1);
            assert_eq!((none.best, none.cost), (none.start, none.start_cost));
        }
    }
}
