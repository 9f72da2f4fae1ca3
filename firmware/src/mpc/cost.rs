//! The cost J and its derivatives with respect to the plan (docs/mpc.md, eq. 4 to 7).

use super::Problem;
use super::prediction::{Trajectory, shift};
use super::tangent::{self, Stage, Tangent};
use crate::model::{ChannelJacobian, Jacobian, Model};

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

    /// Adds to an element of H; one outside is nowhere.
    #[inline(always)]
    pub(super) fn add(&mut self, row: usize, column: usize, value: f32) {
        if let Some(place) = self
            .hessian
            .get_mut(row)
            .and_then(|row| row.get_mut(column))
        {
            *place += value;
        }
    }

    /// `H p`.
    pub fn hessian_times(&self, p: &[f32; NV]) -> [f32; NV] {
        let mut hp = [0.0; NV];
        for (hp, row) in hp.iter_mut().zip(&self.hessian) {
            *hp = dot(row, p);
        }
        hp
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
        // The place that waits for u(k) goes: every step brings its own.
        for lag in 1..ND {
            regressor.u[lag - 1] = regressor.u[lag];
        }
        let mut cost = self.cost_of_moves(plan) + M::penalty(self, plan);
        let rows = self.reference.iter().zip(&mut trajectory.weighted);
        for (j, (trace, (reference, weighted))) in
            trajectory.traces.iter_mut().zip(rows).enumerate()
        {
            let u = self.horizons.command(plan, &self.bounds.previous, j);
            let y = self
                .model
                .advance(&mut regressor, &u, self.disturbance, trace);
            if j + 1 < self.horizons.first {
                continue;
            }
            let rows = y.iter().zip(reference).zip(&self.weights.tracking);
            for (weighted, ((y, r), q)) in weighted.iter_mut().zip(rows) {
                let error = y - r;
                *weighted = q * error;
                cost += *weighted * error;
            }
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
        let mut blocks = [[[[0.0; NU]; NY]; DD]; NB];
        let mut gradient = [[0.0; NU]; NB];
        let mut pairs = [[[[0.0; NU]; NU]; NB]; NB];
        let mut channels = [[[0.0; NU]; NS]; NB];
        let mut carried = 0;
        let mut inputs = [None; ND];
        for (j, (trace, weighted)) in trajectory
            .traces
            .iter()
            .zip(&trajectory.weighted)
            .enumerate()
        {
            let place = self.horizons.place(j);
            shift(&mut inputs, place);
            let reached = place.map_or(0, |place| place.block + 1);
            let stage = Stage {
                carried,
                reached,
                inputs,
                weighted: (j + 1 >= self.horizons.first).then_some(weighted),
                tracking: &self.weights.tracking,
            };
            let mut tangent = Tangent {
                blocks: &mut blocks,
                gradient: &mut gradient,
                pairs: pairs.as_flattened_mut(),
            };
            if M::PREDICTS_CHANNELS {
                let (mut jacobian, mut of_channels) = (Jacobian::ZERO, ChannelJacobian::ZERO);
                self.model.jacobian(trace, &mut jacobian);
                self.model.channel_jacobian(trace, &mut of_channels);
                tangent::carry_channels(
                    &jacobian,
                    &of_channels,
                    &stage,
                    &mut tangent,
                    &mut channels,
                );
            } else {
                self.model.carry(trace, &stage, &mut tangent);
            }
            carried = reached;
        }
        let gradients = gradient.as_flattened().iter();
        for (place, value) in quadratic.gradient.iter_mut().zip(gradients) {
            *place = *value;
        }
        let mut pairs = pairs.as_flattened().iter();
        for b in 0..NB {
            for (m, pair) in (0..=b).zip(&mut pairs) {
                for (a, row) in pair.iter().enumerate() {
                    for (c, value) in row.iter().enumerate() {
                        let (row, column) = (b * NU + a, m * NU + c);
                        quadratic.add(row, column, *value);
                        if m < b {
                            quadratic.add(column, row, *value);
                        }
                    }
                }
            }
        }
        self.add_moves(plan, quadratic);
        M::curve(self, plan, trajectory, quadratic);
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

    /// Adds the moves to gradient and Hessian.
    fn add_moves(&self, plan: &[f32; NV], quadratic: &mut Quadratic<NV>) {
        for v in 0..NV {
            let (change, lambda) = self.change(plan, v);
            let force = lambda * change;
            quadratic.gradient[v] += force;
            quadratic.add(v, v, lambda);
            if let Some(before) = v.checked_sub(NU)
                && let Some(gradient) = quadratic.gradient.get_mut(before)
            {
                *gradient -= force;
                quadratic.add(before, before, lambda);
                quadratic.add(v, before, -lambda);
                quadratic.add(before, v, -lambda);
            }
        }
    }
}
