//! The cost J and its derivatives with respect to the plan (docs/mpc.md, eq. 4 to 7).

use super::Problem;
use super::prediction::{Rollout, Sensitivity};
use crate::model::{Jacobian, Model};

/// Diagonals of Q and Lambda.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights<const NU: usize, const NY: usize> {
    /// Q: on the squared tracking error of each output.
    pub tracking: [f32; NY],
    /// Lambda: on the squared change of each command.
    pub moves: [f32; NU],
}

/// The model of J around a plan. Gradient and Hessian are halved: `J(U + p) ~ J + 2 g'p + p'Hp`; the
/// halves cancel in the Newton step.
#[derive(Clone, Debug)]
pub struct Quadratic<const NV: usize> {
    /// J.
    pub cost: f32,
    /// Half of the exact gradient.
    pub gradient: [f32; NV],
    /// Half of the Gauss-Newton Hessian, all of it (symmetric).
    pub hessian: [[f32; NV]; NV],
}

impl<const NV: usize> Quadratic<NV> {
    /// Zero everywhere.
    pub const fn new() -> Self {
        Self {
            cost: 0.0,
            gradient: [0.0; NV],
            hessian: [[0.0; NV]; NV],
        }
    }

    /// `H p`.
    pub fn hessian_times(&self, p: &[f32; NV]) -> [f32; NV] {
        core::array::from_fn(|i| dot(&self.hessian[i], p))
    }

    /// Slope of J along `p`: `2 g'p`.
    pub fn slope(&self, p: &[f32; NV]) -> f32 {
        2.0 * dot(&self.gradient, p)
    }
}

impl<const NV: usize> Default for Quadratic<NV> {
    fn default() -> Self {
        Self::new()
    }
}

/// Inner product, first element first.
#[inline(always)]
pub fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

impl<
    M: Model<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
> Problem<'_, M, NU, NY, NS, ND, DD, N>
{
    /// J of a plan: N predictions.
    #[inline(never)]
    pub fn cost<const NV: usize>(&self, plan: &[f32; NV]) -> f32 {
        let mut rollout = Rollout::new(self.start);
        let mut cost = self.cost_of_moves(plan);
        for (j, reference) in self.reference.iter().enumerate() {
            let y = rollout.advance(self.model, self.disturbance, plan, j);
            for ((y, r), q) in y.iter().zip(reference).zip(&self.weights.tracking) {
                let error = y - r;
                cost += q * error * error;
            }
        }
        cost
    }

    /// J, its exact gradient through the recursion, and its Gauss-Newton Hessian
    /// `sum_j S_j' Q S_j + D' Lambda D`, S_j = dy(k+j)/dU (eq. 5 to 7).
    #[inline(never)]
    pub fn linearise<const NC: usize, const NV: usize>(
        &self,
        plan: &[f32; NV],
        quadratic: &mut Quadratic<NV>,
    ) {
        *quadratic = Quadratic::new();
        let mut rollout = Rollout::new(self.start);
        let mut jacobian = Jacobian {
            u: [[[0.0; NU]; NY]; ND],
            y: [[[0.0; NY]; NY]; DD],
        };
        let mut sensitivity = Sensitivity::<NU, NY, DD, NC>::new();
        for (j, reference) in self.reference.iter().enumerate() {
            let y = rollout.advance_with_sensitivity(
                self.model,
                self.disturbance,
                plan,
                j,
                &mut jacobian,
                &mut sensitivity,
            );
            let mut weighted = [0.0; NY];
            for (c, weighted) in weighted.iter_mut().enumerate() {
                let error = y[c] - reference[c];
                *weighted = self.weights.tracking[c] * error;
                quadratic.cost += *weighted * error;
            }
            // Commands after k+j have no effect on y(k+j+1): their blocks are zero and are skipped.
            let rows = quadratic.hessian.chunks_exact_mut(NU);
            let gradients = quadratic.gradient.chunks_exact_mut(NU);
            let newest = || sensitivity.newest().take(j + 1);
            for (i, ((s, rows), gradient)) in newest().zip(rows).zip(gradients).enumerate() {
                let mut qs = *s;
                for (qs, q) in qs.iter_mut().zip(&self.weights.tracking) {
                    for qs in qs {
                        *qs *= q;
                    }
                }
                for (s, weighted) in s.iter().zip(&weighted) {
                    for (g, s) in gradient.iter_mut().zip(s) {
                        *g += s * weighted;
                    }
                }
                for (m, s) in newest().take(i + 1).enumerate() {
                    for (a, row) in rows.iter_mut().enumerate() {
                        let Some(entries) = row.get_mut(m * NU..(m + 1) * NU) else {
                            continue;
                        };
                        for (b, h) in entries.iter_mut().enumerate() {
                            for (qs, s) in qs.iter().zip(s) {
                                *h += qs[a] * s[b];
                            }
                        }
                    }
                }
            }
        }
        self.add_moves(plan, quadratic);
        for i in 0..NV {
            for j in 0..i {
                quadratic.hessian[j][i] = quadratic.hessian[i][j];
            }
        }
    }

    /// `sum_i du_i' Lambda du_i`.
    fn cost_of_moves<const NV: usize>(&self, plan: &[f32; NV]) -> f32 {
        let mut cost = 0.0;
        for v in 0..NV {
            let before = if v < NU {
                self.bounds.previous[v]
            } else {
                plan[v - NU]
            };
            let change = plan[v] - before;
            cost += self.weights.moves[v % NU] * change * change;
        }
        cost
    }

    /// Adds the moves to J, to the gradient and to the Hessian's lower triangle.
    fn add_moves<const NV: usize>(&self, plan: &[f32; NV], quadratic: &mut Quadratic<NV>) {
        for v in 0..NV {
            let lambda = self.weights.moves[v % NU];
            let before = if v < NU {
                self.bounds.previous[v]
            } else {
                plan[v - NU]
            };
            let change = plan[v] - before;
            let force = lambda * change;
            quadratic.cost += force * change;
            quadratic.gradient[v] += force;
            quadratic.hessian[v][v] += lambda;
            if v >= NU {
                quadratic.gradient[v - NU] -= force;
                quadratic.hessian[v - NU][v - NU] += lambda;
                quadratic.hessian[v][v - NU] -= lambda;
            }
        }
    }
}
