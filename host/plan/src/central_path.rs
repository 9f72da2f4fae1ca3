//! Central path of friction and contact: its parameter falls from what the motion's own energy is
//! to 0, where the hard laws are (docs/explanation/planning.md, eq. 3).

use crate::descend::{Criteria, FIRST_DAMPING, Point};
use crate::problem::PlanProblem;

/// Factor by which the parameter falls from level to level.
const FALL: f64 = 0.2;
/// Levels before the hard laws.
const LEVELS: usize = 4;
/// First parameter as a part of the kinetic energy.
const FIRST: f64 = 1.0;
/// The path begins at the first level where the sampled commands cost at most this many times
/// what they do under the hard laws: further up, its laws are another plant.
const FAR: f64 = 4.0;
/// Levels between the energy of a push at the limits and the smallest first parameter.
const MOST_FALLS: i32 = 12;
/// Steps at one level.
const STEPS: usize = 2;
/// Relative decrease of the cost below which a level ends.
const ENOUGH: f64 = 0.02;
/// Relative decrease below which the search under the hard laws ends.
const CONVERGED: f64 = 1e-3;
/// Part of the simulations that the path may take; the rest is for the hard laws.
const PART: f64 = 0.75;

/// A level of the path, for reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Parameter of the central path, W and J; 0 for the hard laws.
    pub smoothing: f64,
    /// Cost under the laws of the level.
    pub cost: f64,
    /// Cost of the same commands under the hard laws.
    pub hard_cost: f64,
}

impl PlanProblem {
    /// First parameter of the path: the largest kinetic energy that the commands give, J, and that
    /// number of watts. `None` where nothing moves.
    pub(crate) fn first_smoothing(&self, x: &[f64]) -> Option<f64> {
        self.counter.plain();
        let drive = self.drive(x).ok()?;
        let inertias = self.plant.inertias(&self.values);
        let bodies = self.plant.bodies();
        let mut most = 0.0f64;
        let visit = |_: usize, stepper: &sinew_sim::Stepper<f64>| {
            let state = stepper.state();
            let velocities = &state[bodies..bodies + inertias.len()];
            let energies = inertias.iter().zip(velocities);
            most = most.max(energies.map(|(m, v)| 0.5 * m * v * v).sum());
        };
        self.plant
            .simulate_with(&self.values, &self.start, &drive, &self.layout.t, visit)
            .ok()?;
        (most.is_finite() && most > 0.0).then_some(FIRST * most)
    }

    /// First parameter for a point at which nothing moves: from the kinetic energy of a push at the
    /// limits, down to where the point costs about what it does under the hard laws.
    pub(crate) fn first_from(&self, point: &Point) -> Option<f64> {
        let most = self.first_smoothing(&self.push())?;
        let levels = (0..MOST_FALLS).map(|level| most * FALL.powi(level));
        levels
            .into_iter()
            .find(|&level| self.cost(level, &point.x) <= FAR * point.cost)
    }

    /// Follows the path from a point, then finishes under the hard laws. Returns the best point
    /// under the hard laws, which may be the first.
    pub(crate) fn follow(
        &self,
        from: &Point,
        first: f64,
        simulations: usize,
        progress: &mut dyn FnMut(Level),
    ) -> Point {
        let mut best = from.clone();
        let mut x = from.x.clone();
        let mut damping = FIRST_DAMPING;
        let used = self.count().equivalent();
        let part = used + (PART * simulations.saturating_sub(used) as f64) as usize;
        let mut smoothing = first;
        let mut joined = false;
        for _ in 0..LEVELS {
            let criteria = Criteria {
                steps: STEPS,
                relative: ENOUGH,
                simulations: part,
            };
            let level = smoothing;
            smoothing *= FALL;
            let mut point = self.point(level, x.clone());
            let far = point.cost > FAR * best.cost;
            if far && !joined {
                continue;
            }
            if far && x != best.x {
                let other = self.point(level, best.x.clone());
                if other.cost < point.cost {
                    point = other;
                }
            }
            joined = true;
            let point = self.descend(level, point, &mut damping, criteria);
            let hard = self.point(0.0, point.x.clone());
            progress(Level {
                smoothing: level,
                cost: point.cost,
                hard_cost: hard.cost,
            });
            x = point.x;
            if hard.cost < best.cost {
                best = hard;
            }
        }
        self.finish(best, simulations, progress)
    }

    /// Descends under the hard laws alone.
    pub(crate) fn finish(
        &self,
        from: Point,
        simulations: usize,
        progress: &mut dyn FnMut(Level),
    ) -> Point {
        let criteria = Criteria {
            steps: usize::MAX,
            relative: CONVERGED,
            simulations,
        };
        let mut damping = FIRST_DAMPING;
        let point = self.descend(0.0, from, &mut damping, criteria);
        progress(Level {
            smoothing: 0.0,
            cost: point.cost,
            hard_cost: point.cost,
        });
        point
    }
}
