//! Searches for the variables of a plan: the one of [`crate::plan()`], and those that it is
//! measured against.

use crate::central_path::Level;
use crate::descend::{Criteria, FIRST_DAMPING};
use crate::options::Options;
use crate::problem::PlanProblem;
use crate::sample;

/// A search for the commands of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Search {
    /// Samples, then the central path, then the hard laws.
    CentralPath,
    /// The central path from rest, then the hard laws.
    PathFromRest,
    /// Gradients of the hard laws alone, from rest.
    HardFromRest,
    /// Gradients at one parameter of the central path, from rest.
    FixedFromRest(f64),
    /// Samples, then gradients of the hard laws.
    SamplesThenHard,
}

/// Variables that a search ended with.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Decision variables, inside all limits.
    pub x: Vec<f64>,
    /// Cost under the hard laws.
    pub cost: f64,
    /// Levels of the central path.
    pub levels: Vec<Level>,
}

/// Searches with at most `options.simulations` simulations, those that the problem took before
/// included. `progress` hears of each level.
pub fn search(
    problem: &PlanProblem,
    options: &Options,
    how: Search,
    progress: &mut dyn FnMut(&Level),
) -> Found {
    let mut levels = Vec::new();
    let budget = options.simulations;
    let mut note = |level: Level| {
        progress(&level);
        levels.push(level);
    };
    let point = match how {
        Search::CentralPath | Search::SamplesThenHard => {
            let left = budget.saturating_sub(problem.count().equivalent() + 1);
            let samples = options.samples.clamp(1, left.max(1));
            let points = sample::best_of(problem, samples, options.seed);
            let moving = |point: &crate::descend::Point| problem.first_smoothing(&point.x);
            match (how, points.iter().take(3).find_map(moving)) {
                (Search::CentralPath, Some(first)) => {
                    problem.follow(&points[0], first, budget, &mut note)
                }
                _ => problem.finish(points[0].clone(), budget, &mut note),
            }
        }
        Search::PathFromRest => {
            let point = problem.point(0.0, problem.rest());
            match problem.first_from(&point) {
                Some(first) => problem.follow(&point, first, budget, &mut note),
                None => problem.finish(point, budget, &mut note),
            }
        }
        Search::HardFromRest => {
            let point = problem.point(0.0, problem.rest());
            problem.finish(point, budget, &mut note)
        }
        Search::FixedFromRest(smoothing) => {
            let criteria = Criteria {
                steps: usize::MAX,
                relative: 1e-4,
                simulations: budget.saturating_sub(1),
            };
            let mut damping = FIRST_DAMPING;
            let point = problem.point(smoothing, problem.rest());
            let point = problem.descend(smoothing, point, &mut damping, criteria);
            problem.point(0.0, point.x)
        }
    };
    Found {
        x: point.x,
        cost: point.cost,
        levels,
    }
}
