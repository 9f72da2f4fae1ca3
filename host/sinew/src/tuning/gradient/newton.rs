//! The optimal control problem of a step in any scalar, and the firmware's safeguarded Newton
//! iterations on it (docs/explanation/controller.md, sections 1 and 5).

use sinew_sim::Scalar;

use super::network::{Predictor, Trace};
use super::plan::{Active, Blocks, Bounds};
use super::subproblem::{Quadratic, dot};

/// The firmware's constants of the same names.
const BACKTRACKS: usize = 2;
const SUFFICIENT_DECREASE: f64 = 1e-4;
const CONVERGED: f64 = 1e-4;
const MODEL_AGREEMENT: f64 = 5e-3;
const NOISE: f64 = 1e-7;
const NOISE_ABSOLUTE: f64 = 1e-10;
const RESTART_RATIO: f64 = 8.0;
const PERTURBATION: f64 = 0.125;

/// Planned commands at the ends of the blocks, and the limits that were active there.
pub struct Plan<S> {
    /// Time-major.
    pub u: Vec<S>,
    /// The active set.
    pub active: Active,
    /// J when it was made.
    pub cost: f64,
}

/// One optimisation, in model units.
pub struct Problem<'a, S> {
    /// The predictor.
    pub predictor: &'a Predictor<'a>,
    /// The regressor; its newest command is a place for u(k).
    pub start: &'a [S],
    /// Disturbance, added to every prediction.
    pub disturbance: &'a [S],
    /// r(k+1) .. r(k+N).
    pub reference: &'a [Vec<f64>],
    /// Q.
    pub tracking: &'a [S],
    /// Lambda.
    pub moves: &'a [S],
    /// R (eq. 4c).
    pub command_weight: f64,
    /// Limits.
    pub bounds: &'a Bounds<S>,
    /// Horizon and blocks.
    pub blocks: &'a Blocks,
}

/// Results of a rollout for the derivatives.
struct Path<S> {
    cost: S,
    traces: Vec<Trace<S>>,
    /// Q e of each step; zero before N1.
    weighted: Vec<Vec<S>>,
}

/// Makes room at the newest place of `values`, a vector as long as `newest` at a time.
pub fn enter<S: Copy>(values: &mut [S], newest: &[S]) {
    let kept = values.len() - newest.len();
    values.copy_within(..kept, newest.len());
    values[..newest.len()].copy_from_slice(newest);
}

impl<S: Scalar> Problem<'_, S> {
    /// Change over the block that ends at `v`, and Lambda for the whole of it.
    fn change(&self, plan: &[S], v: usize) -> (S, S) {
        let inputs = self.predictor.inputs;
        let before = if v < inputs {
            self.bounds.previous[v]
        } else {
            plan[v - inputs]
        };
        let length = self.blocks.length[v / inputs] as f64;
        (plan[v] - before, self.moves[v % inputs] / length)
    }

    fn rollout(&self, plan: &[S]) -> Path<S> {
        let predictor = self.predictor;
        let (first_output, first_channel) = (predictor.first_output(), predictor.first_channel());
        let mut x = self.start.to_vec();
        x.copy_within(predictor.inputs..first_output, 0);
        let mut cost = S::ZERO;
        for v in 0..plan.len() {
            let (change, lambda) = self.change(plan, v);
            cost += lambda * change * change + plan[v] * plan[v] * self.command_weight;
        }
        let (mut traces, mut weighted) = (Vec::new(), Vec::new());
        for (j, reference) in self.reference.iter().enumerate() {
            let u = self.blocks.command(j, plan, &self.bounds.previous);
            enter(&mut x[..first_output], &u);
            let mut trace = Trace::new();
            let mut y = predictor.predict(&x, &mut trace);
            for (y, d) in y.iter_mut().zip(self.disturbance) {
                *y += *d;
            }
            enter(&mut x[first_output..first_channel], &y);
            let mut row = vec![S::ZERO; y.len()];
            if j + 1 >= self.blocks.first {
                for (r, weighted) in row.iter_mut().enumerate() {
                    let error = y[r] - reference[r];
                    *weighted = self.tracking[r] * error;
                    cost += *weighted * error;
                }
            }
            traces.push(trace);
            weighted.push(row);
        }
        Path {
            cost,
            traces,
            weighted,
        }
    }

    /// Gradient and Gauss-Newton Hessian (eq. 5 to 7) at the plan that left `path`.
    fn linearise(&self, plan: &[S], path: &Path<S>) -> Quadratic<S> {
        let predictor = self.predictor;
        let (n, inputs, outputs) = (plan.len(), predictor.inputs, predictor.outputs);
        let first_output = predictor.first_output();
        let mut quadratic = Quadratic {
            gradient: vec![S::ZERO; n],
            hessian: vec![vec![S::ZERO; n]; n],
        };
        // dy(k+j), dy(k+j-1) .. by each decision variable.
        let mut slopes = vec![vec![S::ZERO; outputs * predictor.past_outputs]; n];
        for (j, (trace, weighted)) in path.traces.iter().zip(&path.weighted).enumerate() {
            let jacobian = predictor.jacobian(trace);
            let active = (self.blocks.places[j].0 + 1) * inputs;
            for (v, slopes) in slopes.iter_mut().enumerate().take(active) {
                let (block, c) = (v / inputs, v % inputs);
                let next: Vec<S> = (jacobian.iter())
                    .map(|row| {
                        let mut sum = dot(&row[first_output..], slopes);
                        for lag in 0..predictor.past_inputs.min(j + 1) {
                            let (at, weight) = self.blocks.places[j - lag];
                            let share = if at == block {
                                weight
                            } else if at == block + 1 {
                                1.0 - weight
                            } else {
                                continue;
                            };
                            sum += row[lag * inputs + c] * share;
                        }
                        sum
                    })
                    .collect();
                enter(slopes, &next);
            }
            if j + 1 < self.blocks.first {
                continue;
            }
            for v in 0..active {
                let slope = &slopes[v][..outputs];
                quadratic.gradient[v] += dot(slope, weighted);
                let weighed: Vec<S> = (slope.iter().zip(self.tracking))
                    .map(|(s, q)| *s * *q)
                    .collect();
                for (sum, other) in quadratic.hessian[v].iter_mut().zip(&slopes).take(v + 1) {
                    *sum += dot(&weighed, &other[..outputs]);
                }
            }
        }
        for v in 0..n {
            let (change, lambda) = self.change(plan, v);
            let force = lambda * change;
            quadratic.gradient[v] += force + plan[v] * self.command_weight;
            quadratic.hessian[v][v] += lambda + self.command_weight;
            if let Some(before) = v.checked_sub(inputs) {
                quadratic.gradient[before] -= force;
                quadratic.hessian[before][before] += lambda;
                quadratic.hessian[v][before] -= lambda;
            }
        }
        for v in 0..n {
            for w in 0..v {
                quadratic.hessian[w][v] = quadratic.hessian[v][w];
            }
        }
        quadratic
    }

    /// Improves `plan` by at most `iterations` linearisations; false where the prediction is not
    /// finite.
    pub fn improve(&self, plan: &mut Plan<S>, iterations: u8) -> bool {
        self.bounds.project(&mut plan.u);
        let mut path = self.rollout(&plan.u);
        if !path.cost.value().is_finite() {
            return false;
        }
        let (mut cost, before) = (path.cost, plan.cost);
        let mut restarted = false;
        for _ in 0..iterations {
            let quadratic = self.linearise(&plan.u, &path);
            let mut active = plan.active.clone();
            let candidate = quadratic.minimum(self.bounds, &plan.u, &mut active);
            let steps = candidate.iter().zip(&plan.u);
            let step: Vec<S> = steps.map(|(w, u)| *w - *u).collect();
            let slope = quadratic.slope(&step);
            let promised = -(slope + quadratic.curvature(&step));
            if !promised.value().is_finite() {
                break;
            }
            let (agrees, ended);
            if promised.value() <= CONVERGED * cost.value() + NOISE_ABSOLUTE {
                agrees = !active.is_empty();
                if promised.value() > NOISE * cost.value() + NOISE_ABSOLUTE {
                    plan.u = candidate;
                    plan.active = active;
                    cost -= promised;
                }
                ended = true;
            } else {
                path = self.rollout(&candidate);
                let reached = path.cost;
                if reached.value() <= (cost + slope * SUFFICIENT_DECREASE).value() {
                    let expected = (cost - promised).value();
                    plan.u = candidate;
                    plan.active = active;
                    cost = reached;
                    agrees = (cost.value() - expected).abs() <= MODEL_AGREEMENT * cost.value();
                    ended = agrees;
                } else {
                    agrees = false;
                    ended = !self.shorten(plan, &mut path, &step, slope, &mut cost);
                }
            }
            if !agrees && !restarted && cost.value() > RESTART_RATIO * before {
                restarted = true;
                self.restart(plan, cost.value());
                path = self.rollout(&plan.u);
                cost = path.cost;
            } else if ended {
                break;
            }
        }
        plan.cost = cost.value();
        true
    }

    /// The line search: takes the fraction of `step` that lowers J, if one does.
    fn shorten(
        &self,
        plan: &mut Plan<S>,
        path: &mut Path<S>,
        step: &[S],
        slope: S,
        cost: &mut S,
    ) -> bool {
        let (mut fraction, mut reached) = (S::constant(1.0), path.cost);
        for _ in 0..BACKTRACKS {
            let rise = reached - *cost - slope * fraction;
            let minimum = -slope * fraction * fraction / (rise * 2.0);
            fraction = if minimum.value() > 0.1 * fraction.value() {
                minimum.min(fraction * 0.5)
            } else {
                fraction * 0.1
            };
            let mut shorter: Vec<S> = (plan.u.iter().zip(step))
                .map(|(u, step)| *u + fraction * *step)
                .collect();
            self.bounds.project(&mut shorter);
            *path = self.rollout(&shorter);
            reached = path.cost;
            let enough = *cost + fraction * slope * SUFFICIENT_DECREASE;
            if reached.value() <= enough.value() {
                plan.u = shorter;
                *cost = reached;
                return true;
            }
        }
        false
    }

    /// Looks to both sides of a plan of this cost and replaces it by what is better.
    fn restart(&self, plan: &mut Plan<S>, cost: f64) {
        let (mut least, found) = (cost, plan.u.clone());
        let inputs = self.predictor.inputs;
        for channel in 0..inputs {
            let range = self.bounds.upper[channel] - self.bounds.lower[channel];
            if !range.is_finite() {
                continue;
            }
            for move_by in [PERTURBATION * range, -PERTURBATION * range] {
                let mut candidate = found.clone();
                for u in candidate.iter_mut().skip(channel).step_by(inputs) {
                    *u = *u + move_by;
                }
                self.bounds.project(&mut candidate);
                let reached = self.rollout(&candidate).cost.value();
                if reached < least {
                    plan.active = Active::none(candidate.len());
                    plan.u = candidate;
                    least = reached;
                }
            }
        }
    }
}
