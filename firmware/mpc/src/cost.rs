//! The cost J and its derivatives with respect to the plan (docs/explanation/controller.md, eq. 4
//! to 7).

use crate::chunk::chunk_mut;
use crate::model::{Model, Regressor};
use crate::move_blocking::Interpolation;
use crate::problem::Problem;
use crate::rollout::Trajectory;
use crate::sensitivity::{Propagate, Sensitivities, Stage};
use crate::tuning::Tuning;

/// The model of J around a plan. Gradient and Hessian are halved: `J(U + p) ~ J + 2 g'p + p'Hp`;
/// the halves cancel in the Newton step.
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
    pub(crate) fn add(&mut self, row: usize, column: usize, value: f32) {
        if let Some(place) = self
            .hessian
            .get_mut(row)
            .and_then(|row| row.get_mut(column))
        {
            *place += value;
        }
    }

    /// Fills H by its lower triangle of blocks, `NU` by `NU`, row after row.
    fn enter<const NU: usize, const NB: usize>(&mut self, pairs: &[[[[f32; NU]; NU]; NB]; NB]) {
        let mut pairs = pairs.as_flattened().iter();
        for b in 0..NB {
            for (m, pair) in (0..=b).zip(&mut pairs) {
                let rows = self.hessian.iter_mut().skip(b * NU);
                for (row, values) in rows.zip(pair) {
                    if let Some(place) = chunk_mut(row, m) {
                        *place = *values;
                    }
                }
            }
        }
        // The blocks on the diagonal have their own roundings above it.
        for row in NU..NV {
            for column in 0..row - row % NU {
                self.hessian[column][row] = self.hessian[row][column];
            }
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

    /// Curvature of J along `p`: `p'Hp`, the sum of `p_i (H p)_i`.
    pub fn curvature(&self, p: &[f32; NV]) -> f32 {
        let mut sum = 0.0;
        for (p_i, row) in p.iter().zip(&self.hessian) {
            sum += p_i * dot(row, p);
        }
        sum
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

/// Inner product, first element first. One copy for all, four elements at a time: a loop over
/// single ones takes twice as long, one that is written out for a known length fills flash.
#[inline(never)]
pub fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    let mut sum = 0.0;
    let (a, a_rest) = a.split_at(N - N % 4);
    let (b, b_rest) = b.split_at(N - N % 4);
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        sum += a[0] * b[0];
        sum += a[1] * b[1];
        sum += a[2] * b[2];
        sum += a[3] * b[3];
    }
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += a * b;
    }
    sum
}

/// A predictor, with what it adds to the cost J.
///
/// Every model with [`Propagate`] is one that adds nothing.
/// [`Exact`](crate::exact_hessian::Exact) and [`Barred`](crate::barrier::Barred) go around a model.
pub trait CostTerm<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>: Sized
{
    /// The predictor.
    type Model: Propagate<NU, NY, NS, ND, DD>;

    /// Residuals of a cost-to-go at the end of the horizon (eq. 4d); `()` where there is none.
    type Residuals: Copy;

    /// Residuals before any rollout.
    const RESIDUALS: Self::Residuals;

    /// The predictor.
    fn model(&self) -> &Self::Model;

    /// The term's value at a plan; 0 by default.
    #[inline(always)]
    fn penalty<const N: usize, const NB: usize, const NV: usize>(
        _problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        _plan: &[f32; NV],
    ) -> f32 {
        0.0
    }

    /// Adds the term's halved derivatives to gradient and Hessian; nothing by default.
    #[inline(always)]
    fn linearise<const N: usize, const NB: usize, const NV: usize>(
        _problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        _plan: &[f32; NV],
        _path: &Path<Self, NU, NY, NS, ND, DD, N>,
        _quadratic: &mut Quadratic<NV>,
    ) {
    }

    /// Takes over what the cost-to-go needs once a step: the reference from r(k+N) on, and the
    /// disturbance. Nothing by default.
    #[inline(always)]
    fn prepare(&mut self, _reference: &[[f32; NY]], _disturbance: &[f32]) {}

    /// Cost-to-go of the regressor at the end of the horizon; leaves its residuals. 0 by default.
    #[inline(always)]
    fn cost_to_go(
        &self,
        _end: &Regressor<NU, NY, NS, ND, DD>,
        _residuals: &mut Self::Residuals,
    ) -> f32 {
        0.0
    }

    /// Adds the halved derivatives of the cost-to-go; nothing by default.
    #[inline(always)]
    fn linearise_cost_to_go<const NB: usize>(
        &self,
        _residuals: &Self::Residuals,
        _end: &End<'_, NU, NY, NS, DD, NB>,
        _gradient: &mut [[f32; NU]],
        _pairs: &mut [[[f32; NU]; NU]],
    ) {
    }
}

/// Sensitivities at the end of the horizon.
pub struct End<
    'a,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const DD: usize,
    const NB: usize,
> {
    /// Blocks with an effect.
    pub active: usize,
    /// Interpolation of u(k) .. u(k+N-1) in the plan, the newest last.
    pub inputs: &'a [Interpolation],
    /// `[b][lag][r][c]` is the derivative of y_r(k+N-lag) by the command of channel c at the end of
    /// block b.
    pub blocks: &'a [[[[f32; NU]; NY]; DD]; NB],
    /// `[b][r][c]` is that of s_r(k+N); zero where the channels are held.
    pub channels: &'a [[[f32; NU]; NS]; NB],
}

impl<'a, const NU: usize, const NY: usize, const NS: usize, const DD: usize, const NB: usize>
    End<'a, NU, NY, NS, DD, NB>
{
    /// The same with the number of blocks written out, for code that is compiled for it; `None`
    /// where there are fewer.
    #[inline(always)]
    pub fn with_blocks<const B: usize>(&self) -> Option<End<'a, NU, NY, NS, DD, B>> {
        Some(End {
            active: self.active,
            inputs: self.inputs,
            blocks: self.blocks.first_chunk()?,
            channels: self.channels.first_chunk()?,
        })
    }
}

/// Results of a rollout for a cost term: its model's traces and its residuals.
pub type Path<
    C,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
> = Trajectory<Trace<C, NU, NY, NS, ND, DD>, NY, N, <C as CostTerm<NU, NY, NS, ND, DD>>::Residuals>;

/// The trace of a cost term's model.
pub type Trace<
    C,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> = <<C as CostTerm<NU, NY, NS, ND, DD>>::Model as Model<NU, NY, NS, ND, DD>>::Trace;

impl<
    M: Propagate<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> CostTerm<NU, NY, NS, ND, DD> for M
{
    type Model = M;
    type Residuals = ();
    const RESIDUALS: () = ();

    #[inline(always)]
    fn model(&self) -> &M {
        self
    }
}

impl<
    M: CostTerm<NU, NY, NS, ND, DD>,
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
    /// J of a plan (eq. 4): N predictions, which leave in `trajectory` what [`Problem::linearise`]
    /// needs.
    #[inline(never)]
    pub fn rollout(
        &self,
        plan: &[f32; NV],
        trajectory: &mut Path<M, NU, NY, NS, ND, DD, N>,
    ) -> f32 {
        // Part by part: what is copied whole becomes a call of memcpy.
        let Regressor { u, y, s } = self.start;
        let mut regressor = Regressor {
            u: *u,
            y: *y,
            s: *s,
        };
        // The place that waits for u(k) goes: every step brings its own.
        for (place, older) in regressor.u.iter_mut().zip(self.start.u.iter().skip(1)) {
            *place = *older;
        }
        let mut cost = self.cost_of_moves(plan) + M::penalty(self, plan);
        let mut uncounted = self.horizons.first.saturating_sub(1);
        let rows = self.reference.iter().zip(&mut trajectory.weighted);
        let steps = trajectory
            .traces
            .iter_mut()
            .zip(&self.horizons.interpolation);
        for ((trace, place), (reference, weighted)) in steps.zip(rows) {
            let u = place.command(plan, &self.bounds.previous);
            let y = self
                .model
                .model()
                .advance(&mut regressor, &u, self.disturbance, trace);
            let counted = if uncounted == 0 { NY } else { 0 };
            uncounted = uncounted.saturating_sub(1);
            let rows = y.iter().zip(reference).zip(&self.weights.tracking);
            for (weighted, ((y, r), q)) in weighted.iter_mut().zip(rows).take(counted) {
                let error = y - r;
                *weighted = q * error;
                cost += *weighted * error;
            }
        }
        cost + (self.model).cost_to_go(&regressor, &mut trajectory.residuals)
    }

    /// The exact gradient of J through the recursion and its Gauss-Newton Hessian
    /// `sum_j S_j' Q S_j + D' Lambda D`, S_j = dy(k+j)/dv (eq. 5 to 7), at the plan that left
    /// `trajectory`.
    #[inline(never)]
    pub fn linearise(
        &self,
        plan: &[f32; NV],
        trajectory: &Path<M, NU, NY, NS, ND, DD, N>,
        quadratic: &mut Quadratic<NV>,
    ) {
        let mut gradient = [[0.0; NU]; NB];
        let mut blocks = const { [[[[0.0; NU]; NY]; DD]; NB] };
        let mut pairs = const { [[[[0.0; NU]; NU]; NB]; NB] };
        let mut channels = const { [[[0.0; NU]; NS]; NB] };
        let mut active_before = 0;
        for (j, (trace, weighted)) in trajectory
            .traces
            .iter()
            .zip(&trajectory.weighted)
            .enumerate()
        {
            let inputs = self.horizons.interpolation.get(..=j).unwrap_or_default();
            let active = inputs.last().map_or(0, |place| place.block + 1);
            let stage = Stage {
                active_before,
                active,
                inputs,
                weighted: (j + 1 >= self.horizons.first).then_some(weighted),
                tracking: &self.weights.tracking,
            };
            let mut sensitivities = Sensitivities {
                blocks: &mut blocks,
                gradient: &mut gradient,
                pairs: pairs.as_flattened_mut(),
            };
            if M::Model::PREDICTS_CHANNELS {
                self.model.model().propagate_channels(
                    trace,
                    &stage,
                    &mut sensitivities,
                    &mut channels,
                );
            } else {
                self.model
                    .model()
                    .propagate(trace, &stage, &mut sensitivities);
            }
            active_before = active;
        }
        let end = End {
            active: active_before,
            inputs: &self.horizons.interpolation,
            blocks: &blocks,
            channels: &channels,
        };
        self.model.linearise_cost_to_go(
            &trajectory.residuals,
            &end,
            &mut gradient,
            pairs.as_flattened_mut(),
        );
        quadratic.enter::<NU, NB>(&pairs);
        self.add_moves(plan, &gradient, quadratic);
        M::linearise(self, plan, trajectory, quadratic);
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

    /// `sum_i du_i' Lambda du_i`, and R of (4c) on the ends of the blocks.
    fn cost_of_moves(&self, plan: &[f32; NV]) -> f32 {
        let mut cost = 0.0;
        for v in 0..NV {
            let (change, lambda) = self.change(plan, v);
            cost += lambda * change * change;
            if M::Model::COMMAND_WEIGHT > 0.0 {
                cost += M::Model::COMMAND_WEIGHT * plan[v] * plan[v];
            }
        }
        cost
    }

    /// Adds the moves, and the commands themselves where they have a weight, to the Hessian, and
    /// enters the gradient: `tracking` and theirs.
    fn add_moves(
        &self,
        plan: &[f32; NV],
        tracking: &[[f32; NU]; NB],
        quadratic: &mut Quadratic<NV>,
    ) {
        for (v, tracking) in (0..NV).zip(tracking.as_flattened()) {
            let (change, lambda) = self.change(plan, v);
            let force = lambda * change;
            quadratic.gradient[v] = tracking + force;
            quadratic.add(v, v, lambda);
            if M::Model::COMMAND_WEIGHT > 0.0 {
                quadratic.gradient[v] += M::Model::COMMAND_WEIGHT * plan[v];
                quadratic.add(v, v, M::Model::COMMAND_WEIGHT);
            }
            let Some(before) = v.checked_sub(NU) else {
                continue;
            };
            if let Some(gradient) = quadratic.gradient.get_mut(before) {
                *gradient -= force;
                quadratic.add(before, before, lambda);
                quadratic.add(v, before, -lambda);
                quadratic.add(before, v, -lambda);
            }
        }
    }
}
