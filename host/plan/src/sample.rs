//! Coarse commands, drawn at random: they pick the basin in which gradients finish
//! (docs/explanation/planning.md).

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::descend::Point;
use crate::problem::PlanProblem;

/// Numbers of coarse levels that are drawn from.
const LEVELS: [usize; 4] = [2, 3, 4, 6];
/// Part of the samples that are drawn anew; the others are near the best so far.
const ANEW: f64 = 0.6;
/// Samples near the best that are drawn at once.
const GENERATION: usize = 4;
/// Smallest part of the range that a sample may use.
const SMALLEST: f64 = 0.1;

/// Draws coarse commands and simulates them under the hard laws; the best first.
pub(crate) fn best_of(problem: &PlanProblem, samples: usize, seed: u64) -> Vec<Point> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let anew = (ANEW * samples as f64).ceil() as usize;
    let drawn = (0..anew).map(|_| coarse(problem, &mut random)).collect();
    let mut points = vec![problem.point(0.0, problem.rest())];
    extend(problem, &mut points, drawn);
    while points.len() < samples {
        let count = GENERATION.min(samples - points.len());
        let best = &points[0].x;
        let drawn = (0..count)
            .map(|_| near(problem, best, &mut random))
            .collect();
        extend(problem, &mut points, drawn);
    }
    points
}

/// Simulates and sorts by the cost.
fn extend(problem: &PlanProblem, points: &mut Vec<Point>, drawn: Vec<Vec<f64>>) {
    let drawn: Vec<Point> = drawn
        .into_par_iter()
        .map(|x| problem.point(0.0, x))
        .collect();
    points.extend(drawn);
    points.sort_by(|a, b| a.cost.total_cmp(&b.cost));
}

/// Levels at random for equal times, of every input.
fn coarse(problem: &PlanProblem, random: &mut ChaCha8Rng) -> Vec<f64> {
    let layout = &problem.layout;
    let mut x = problem.rest();
    let levels = LEVELS[random.random_range(0..LEVELS.len())];
    let part = SMALLEST.powf(random.random_range(0.0..1.0));
    for (input, x) in x.chunks_mut(layout.knots()).enumerate() {
        let [low, high] = layout.range(input);
        let origin = layout.origin(input);
        let mut level = || origin + part * (random.random_range(low..=high) - origin);
        let drawn: Vec<f64> = (0..levels).map(|_| level()).collect();
        fill(x, &drawn);
    }
    problem.project(&mut x);
    x
}

/// Coarse changes of a point, a fifth of the range in the mean.
fn near(problem: &PlanProblem, best: &[f64], random: &mut ChaCha8Rng) -> Vec<f64> {
    let layout = &problem.layout;
    let mut x = best.to_vec();
    let levels = LEVELS[random.random_range(0..LEVELS.len())];
    let part = 0.4 * SMALLEST.powf(random.random_range(0.0..1.0));
    for (input, x) in x.chunks_mut(layout.knots()).enumerate() {
        let [low, high] = layout.range(input);
        let reach = part * (high - low);
        let drawn: Vec<f64> = (0..levels)
            .map(|_| reach * random.random_range(-1.0..=1.0))
            .collect();
        let mut change = vec![0.0; x.len()];
        fill(&mut change, &drawn);
        x.iter_mut()
            .zip(change)
            .for_each(|(x, change)| *x += change);
    }
    problem.project(&mut x);
    x
}

/// Levels for equal times.
fn fill(x: &mut [f64], levels: &[f64]) {
    let count = x.len();
    for (knot, x) in x.iter_mut().enumerate() {
        *x = levels[knot * levels.len() / count];
    }
}
