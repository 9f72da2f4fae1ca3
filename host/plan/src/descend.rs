//! Levenberg-Marquardt search at one parameter of the central path.

use nalgebra::{DMatrix, DVector};

use crate::problem::PlanProblem;
use crate::step;

/// Damping of the first step.
pub(crate) const FIRST_DAMPING: f64 = 1e-3;
/// Gain ratio above which a step is taken.
const ACCEPT: f64 = 1e-3;
/// Gain ratio above which the damping shrinks.
const GOOD: f64 = 0.7;
/// Gain ratio below which the damping grows although the step is taken.
const FAIR: f64 = 0.2;
/// Steps that are tried from one point before the search counts as stalled.
const TRIALS: usize = 6;

/// A point of the search with its cost.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub x: Vec<f64>,
    pub readings: Vec<f64>,
    pub cost: f64,
}

/// Stopping criteria of one search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Criteria {
    /// Steps at most.
    pub steps: usize,
    /// Relative decrease of the cost below which the search ends.
    pub relative: f64,
    /// Simulations in all, after which the search ends ([`crate::Count::equivalent`]).
    pub simulations: usize,
}

impl PlanProblem {
    /// A point of the search; its cost is infinite where the simulation fails.
    pub(crate) fn point(&self, smoothing: f64, x: Vec<f64>) -> Point {
        match self.readings(smoothing, &x) {
            Ok(readings) => {
                let cost = self.cost_of(&readings, &x);
                Point { x, readings, cost }
            }
            Err(_) => Point {
                readings: vec![f64::NAN; self.targets.len()],
                x,
                cost: f64::INFINITY,
            },
        }
    }

    /// Room for one more Jacobian and a trial.
    fn affords(&self, simulations: usize) -> bool {
        self.count().equivalent() + self.jacobian_cost() < simulations
    }

    /// Lowers the cost from `point` on, each point inside all limits. `damping` is carried from one
    /// search to the next.
    pub(crate) fn descend(
        &self,
        smoothing: f64,
        mut point: Point,
        damping: &mut f64,
        criteria: Criteria,
    ) -> Point {
        for _ in 0..criteria.steps {
            if !(point.cost.is_finite() && self.affords(criteria.simulations)) {
                break;
            }
            let Some((hessian, gradient)) = self.linearise(smoothing, &point) else {
                break;
            };
            let before = point.cost;
            if !self.advance(
                smoothing, &mut point, damping, &hessian, &gradient, criteria,
            ) {
                break;
            }
            if before - point.cost < criteria.relative * before {
                break;
            }
        }
        point
    }

    /// Takes the first step that lowers the cost as predicted; false where none does.
    fn advance(
        &self,
        smoothing: f64,
        point: &mut Point,
        damping: &mut f64,
        hessian: &DMatrix<f64>,
        gradient: &DVector<f64>,
        criteria: Criteria,
    ) -> bool {
        for _ in 0..TRIALS {
            if self.count().equivalent() >= criteria.simulations {
                return false;
            }
            let mut damped = hessian.clone();
            let trace = hessian.diagonal().mean();
            for index in 0..damped.nrows() {
                damped[(index, index)] += *damping * (hessian[(index, index)] + 1e-3 * trace);
            }
            let Some(step) = step::within(&self.layout, &damped, gradient, &point.x) else {
                *damping *= 8.0;
                continue;
            };
            let mut x: Vec<f64> = point.x.iter().zip(&step).map(|(x, d)| x + d).collect();
            self.project(&mut x);
            let taken = DVector::from_iterator(x.len(), x.iter().zip(&point.x).map(|(a, b)| a - b));
            let predicted = -2.0 * gradient.dot(&taken) - taken.dot(&(hessian * &taken));
            let trial = self.point(smoothing, x);
            let ratio = (point.cost - trial.cost) / predicted;
            if trial.cost < point.cost && ratio > ACCEPT {
                *damping *= match ratio {
                    ratio if ratio > GOOD => 0.1,
                    ratio if ratio > FAIR => 1.0,
                    _ => 4.0,
                };
                *damping = damping.max(1e-9);
                *point = trial;
                return true;
            }
            *damping = (*damping * 8.0).max(1e-6);
        }
        false
    }

    /// Gauss-Newton matrix and half the gradient of the cost. `None` where the simulation with
    /// derivatives fails.
    fn linearise(&self, smoothing: f64, point: &Point) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let jacobian = self.jacobian(smoothing, &point.x, self.direction()).ok()?;
        let weights: Vec<f64> = self.targets.iter().map(|target| target.weight).collect();
        let weighted = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |row, column| {
            weights[row] * jacobian[(row, column)]
        });
        let misses = DVector::from_vec(self.misses(&point.readings));
        let mut hessian = weighted.tr_mul(&weighted);
        let mut gradient = weighted.tr_mul(&misses);
        let weight = self.effort_weight();
        let knots = self.layout.knots();
        let square = weight * weight;
        let efforts = self.efforts(&point.x);
        for index in 0..point.x.len() {
            hessian[(index, index)] += 2.0 * square;
            gradient[index] += weight * (efforts[2 * index] + efforts[2 * index + 1]);
            if index % knots != 0 {
                hessian[(index - 1, index - 1)] += square;
                hessian[(index, index - 1)] -= square;
                hessian[(index - 1, index)] -= square;
                gradient[index - 1] -= weight * efforts[2 * index + 1];
            }
        }
        let finite = hessian
            .iter()
            .chain(&gradient)
            .all(|entry| entry.is_finite());
        finite.then_some((hessian, gradient))
    }
}
