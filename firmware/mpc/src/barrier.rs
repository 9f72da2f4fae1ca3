//! The published barrier on the commands, an option (docs/explanation/controller.md, eq. 4b): it
//! makes a command dearer as it nears its limit, so that it turns away before it is stopped. The
//! limits themselves need no barrier.
//!
//! With d the distance to a limit and r the channel's range, every planned command costs `s / d` at
//! either limit, less `4 s / r`, which makes the middle free. `1 / d` has no value at the limit and
//! none outside, where the command applied last may lie; below d = r / 256 it goes on as the
//! parabola that has its value, slope and curvature there. That keeps J finite, convex in the
//! command, and twice differentiable.

use crate::constraints::Bounds;
use crate::cost::{CostTerm, End, Path, Quadratic};
use crate::model::Regressor;
use crate::problem::Problem;

/// A model whose controller has the barrier, with the sharpness s. 0, a negative number and NaN:
/// none. Goes around [`Exact`](crate::exact_hessian::Exact) where both are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Barred<M>(pub M, pub f32);

impl<M> Barred<M> {
    /// The problem of the model inside.
    fn inside<
        'a,
        const NU: usize,
        const NY: usize,
        const NS: usize,
        const ND: usize,
        const DD: usize,
        const N: usize,
        const NB: usize,
        const NV: usize,
    >(
        problem: &Problem<'a, Self, NU, NY, NS, ND, DD, N, NB, NV>,
    ) -> Problem<'a, M, NU, NY, NS, ND, DD, N, NB, NV> {
        Problem {
            model: &problem.model.0,
            start: problem.start,
            disturbance: problem.disturbance,
            reference: problem.reference,
            weights: problem.weights,
            bounds: problem.bounds,
            horizons: problem.horizons,
        }
    }
}

impl<
    M: CostTerm<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> CostTerm<NU, NY, NS, ND, DD> for Barred<M>
{
    type Model = M::Model;
    type Residuals = M::Residuals;
    const RESIDUALS: M::Residuals = M::RESIDUALS;

    fn model(&self) -> &M::Model {
        self.0.model()
    }

    fn penalty<const N: usize, const NB: usize, const NV: usize>(
        problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        plan: &[f32; NV],
    ) -> f32 {
        let other = M::penalty(&Self::inside(problem), plan);
        let s = problem.model.1;
        if s > 0.0 && s.is_finite() {
            other + cost(s, problem.bounds, plan)
        } else {
            other
        }
    }

    fn linearise<const N: usize, const NB: usize, const NV: usize>(
        problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        plan: &[f32; NV],
        path: &Path<M, NU, NY, NS, ND, DD, N>,
        quadratic: &mut Quadratic<NV>,
    ) {
        M::linearise(&Self::inside(problem), plan, path, quadratic);
        let s = problem.model.1;
        if s > 0.0 && s.is_finite() {
            add_derivatives(s, problem.bounds, plan, quadratic);
        }
    }

    fn prepare(&mut self, reference: &[[f32; NY]], disturbance: &[f32]) {
        self.0.prepare(reference, disturbance);
    }

    fn cost_to_go(&self, end: &Regressor<NU, NY, NS, ND, DD>, residuals: &mut M::Residuals) -> f32 {
        self.0.cost_to_go(end, residuals)
    }

    fn linearise_cost_to_go<const NB: usize>(
        &self,
        residuals: &M::Residuals,
        end: &End<'_, NU, NY, NS, DD, NB>,
        gradient: &mut [[f32; NU]],
        pairs: &mut [[[f32; NU]; NU]],
    ) {
        self.0.linearise_cost_to_go(residuals, end, gradient, pairs);
    }
}

/// Start of the parabola, as a part of the range.
const NEAREST: f32 = 1.0 / 256.0;

/// Value, slope and curvature of `1 / d` and its continuation below `nearest`.
fn reciprocal(d: f32, nearest: f32) -> (f32, f32, f32) {
    let held = if d > nearest { d } else { nearest };
    let value = 1.0 / held;
    let slope = -value * value;
    let curvature = 2.0 * value * value * value;
    let beyond = d - held;
    (
        value + beyond * (slope + 0.5 * beyond * curvature),
        slope + beyond * curvature,
        curvature,
    )
}

/// Value, half the slope and half the curvature of one command's barrier, without s; nought where a
/// limit is missing or the box is a point.
fn of_command(u: f32, lower: f32, upper: f32) -> (f32, f32, f32) {
    let range = upper - lower;
    if !(range > 0.0 && range < f32::INFINITY) {
        return (0.0, 0.0, 0.0);
    }
    let nearest = NEAREST * range;
    let (below, above) = (
        reciprocal(u - lower, nearest),
        reciprocal(upper - u, nearest),
    );
    (
        below.0 + above.0 - 4.0 / range,
        0.5 * (below.1 - above.1),
        0.5 * (below.2 + above.2),
    )
}

/// `s sum (1 / (u - lower) + 1 / (upper - u) - 4 / r)` over the ends of the blocks.
fn cost<const NU: usize, const NV: usize>(
    s: f32,
    bounds: &Bounds<NU, NV>,
    plan: &[f32; NV],
) -> f32 {
    let mut cost = 0.0;
    for ends in plan.chunks_exact(NU) {
        for ((u, lower), upper) in ends.iter().zip(&bounds.lower).zip(&bounds.upper) {
            cost += of_command(*u, *lower, *upper).0;
        }
    }
    s * cost
}

/// Adds the halves of its gradient and of its Hessian, which is diagonal.
fn add_derivatives<const NU: usize, const NV: usize>(
    s: f32,
    bounds: &Bounds<NU, NV>,
    plan: &[f32; NV],
    quadratic: &mut Quadratic<NV>,
) {
    for (v, u) in plan.iter().enumerate() {
        let (Some(lower), Some(upper)) = (bounds.lower.get(v % NU), bounds.upper.get(v % NU))
        else {
            continue;
        };
        let (_, slope, curvature) = of_command(*u, *lower, *upper);
        if let Some(gradient) = quadratic.gradient.get_mut(v) {
            *gradient += s * slope;
        }
        quadratic.add(v, v, s * curvature);
    }
}
