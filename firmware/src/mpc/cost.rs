//! The cost J and its derivatives with respect to the plan (docs/mpc.md, eq. 4 to 7).

use super::Problem;
use super::prediction::{Sensitivity, Trajectory, shift};
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
    /// Half of the exact gradient.
    pub gradient: [f32; NV],
    /// Half of the Gauss-Newton Hessian, all of it (symmetric).
    pub hessian: [[f32; NV]; NV],
}

impl<const NV: usize> Quadratic<NV> {
    /// Zero everywhere.
    pub const fn new() -> Self {
        Self {
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
    const NB: usize,
    const NV: usize,
> Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>
{
    /// J of a plan (eq. 4): N predictions, which leave in `trajectory` what [`Problem::derive`] needs.
    #[inline(never)]
    pub fn roll(&self, plan: &[f32; NV], trajectory: &mut Trajectory<M::Trace, NY, N>) -> f32 {
        let mut regressor = *self.start;
        let mut cost = self.cost_of_moves(plan);
        let rows = self.reference.iter().zip(&mut trajectory.weighted);
        for (j, (trace, (reference, weighted))) in
            trajectory.traces.iter_mut().zip(rows).enumerate()
        {
            let u = self.horizons.command(plan, &self.bounds.previous, j);
            if j > 0 {
                shift(&mut regressor.u, u);
            } else if let Some(newest) = regressor.u.first_mut() {
                // That place is already waiting for it.
                *newest = u;
            }
            let mut y = self.model.predict(&regressor, trace);
            let counts = j + 1 >= self.horizons.first;
            for (c, y) in y.iter_mut().enumerate() {
                *y += self.disturbance[c];
                let error = *y - reference[c];
                let q = if counts {
                    self.weights.tracking[c]
                } else {
                    0.0
                };
                weighted[c] = q * error;
                cost += weighted[c] * error;
            }
            shift(&mut regressor.y, y);
        }
        cost
    }

    /// The exact gradient of J through the recursion and its Gauss-Newton Hessian
    /// `sum_j S_j' Q S_j + D' Lambda D`, S_j = dy(k+j)/dv (eq. 5 to 7), at the plan that left `trajectory`.
    #[inline(never)]
    pub fn derive(
        &self,
        plan: &[f32; NV],
        trajectory: &Trajectory<M::Trace, NY, N>,
        quadratic: &mut Quadratic<NV>,
    ) {
        *quadratic = Quadratic::new();
        let mut jacobian = Jacobian::ZERO;
        let mut sensitivity = Sensitivity::<NU, NY, DD, NB>::new();
        for (j, (trace, weighted)) in trajectory
            .traces
            .iter()
            .zip(&trajectory.weighted)
            .enumerate()
        {
            self.model.jacobian(trace, &mut jacobian);
            let blocks = sensitivity.advance(&jacobian, self.horizons, j);
            if j + 1 >= self.horizons.first {
                self.accumulate(&sensitivity, blocks, weighted, quadratic);
            }
        }
        self.add_moves(plan, quadratic);
        for i in 0..NV {
            for j in 0..i {
                quadratic.hessian[j][i] = quadratic.hessian[i][j];
            }
        }
    }

    /// `g += S' (Q e)` and the lower triangle of `H += S' Q S` for the blocks that have an effect.
    #[inline(always)]
    fn accumulate(
        &self,
        sensitivity: &Sensitivity<NU, NY, DD, NB>,
        blocks: usize,
        weighted: &[f32; NY],
        quadratic: &mut Quadratic<NV>,
    ) {
        let rows = quadratic.hessian.chunks_exact_mut(NU);
        let gradients = quadratic.gradient.chunks_exact_mut(NU);
        let newest = || sensitivity.newest().take(blocks);
        for (b, ((s, rows), gradient)) in newest().zip(rows).zip(gradients).enumerate() {
            let mut qs = *s;
            for (qs, q) in qs.iter_mut().zip(&self.weights.tracking) {
                for qs in qs {
                    *qs *= q;
                }
            }
            for (s, weighted) in s.iter().zip(weighted) {
                for (g, s) in gradient.iter_mut().zip(s) {
                    *g += s * weighted;
                }
            }
            for (m, s) in newest().take(b + 1).enumerate() {
                for (a, row) in rows.iter_mut().enumerate() {
                    let Some(entries) = row.get_mut(m * NU..(m + 1) * NU) else {
                        continue;
                    };
                    for (c, h) in entries.iter_mut().enumerate() {
                        for (qs, s) in qs.iter().zip(s) {
                            *h += qs[a] * s[c];
                        }
                    }
                }
            }
        }
    }

    /// Change over the block that ends at `v`, and Lambda for the whole of it: `L` equal moves.
    #[inline(always)]
    fn change(&self, plan: &[f32; NV], v: usize) -> (f32, f32) {
        let before = if v < NU {
            self.bounds.previous[v]
        } else {
            plan[v - NU]
        };
        let length = self.horizons.length.get(v / NU).copied().unwrap_or(1);
        (
            plan[v] - before,
            self.weights.moves[v % NU] / f32::from(length),
        )
    }

    /// `sum_i du_i' Lambda du_i`.
    fn cost_of_moves(&self, plan: &[f32; NV]) -> f32 {
        let mut cost = 0.0;
        for v in 0..NV {
            let (change, lambda) = self.change(plan, v);
            cost += lambda * change * change;
        }
        cost
    }

    /// Adds the moves to the gradient and to the Hessian's lower triangle.
    fn add_moves(&self, plan: &[f32; NV], quadratic: &mut Quadratic<NV>) {
        for v in 0..NV {
            let (change, lambda) = self.change(plan, v);
            let force = lambda * change;
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
