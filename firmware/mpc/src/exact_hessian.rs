//! The exact Hessian, an option (docs/explanation/controller.md, eq. 7a): a model wrapped in
//! [`Exact`] adds to the Gauss-Newton Hessian the second derivatives of the predictions. Where
//! nothing is wrapped nothing of this is linked.
//!
//! With lambda_j the derivative of J/2 by y(k+j) through everything that follows, and X_j the
//! derivative of what the predictor looks at by the plan, the part that Gauss-Newton leaves out is
//! `sum_j X_j' (sum_r lambda_j,r d2 f_r / dx dx) X_j`: one sweep back along the horizon. It may be
//! indefinite, which the factorisation notices and shifts.

use crate::cost::{CostTerm, Quadratic};
use crate::model::{Jacobian, Regressor, SecondOrder};
use crate::move_blocking::Interpolation;
use crate::problem::Problem;
use crate::rollout::Trajectory;
use crate::sensitivity::Propagate;

/// A model whose controller uses the exact Hessian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exact<M>(pub M);

impl<
    M: SecondOrder<NU, NY, NS, ND, DD> + Propagate<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> CostTerm<NU, NY, NS, ND, DD> for Exact<M>
{
    type Model = M;
    type Residuals = ();
    const RESIDUALS: () = ();

    fn model(&self) -> &M {
        &self.0
    }

    /// Cost: per step of the horizon two Jacobians, `NV` products with the curvature of the model,
    /// and `NV^2 (NU ND + NY DD) / 2` multiply-adds.
    fn linearise<const N: usize, const NB: usize, const NV: usize>(
        problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        _: &[f32; NV],
        trajectory: &Trajectory<M::Trace, NY, N>,
        quadratic: &mut Quadratic<NV>,
    ) {
        const {
            assert!(
                !M::PREDICTS_CHANNELS,
                "the exact Hessian is for models that hold their channels"
            )
        };
        let model = &problem.model.0;
        let mut jacobian = Jacobian::ZERO;
        // dy(k+j+1)/dv, from the first step to the last.
        let mut slopes = [[[0.0; NY]; NV]; N];
        for (j, trace) in trajectory.traces.iter().enumerate() {
            model.jacobian(trace, &mut jacobian);
            for v in 0..NV {
                let x = direction(problem, &slopes, j, v);
                if let Some(slope) = slopes.get_mut(j).and_then(|row| row.get_mut(v)) {
                    *slope = along(&jacobian, &x);
                }
            }
        }
        let mut adjoint = trajectory.weighted;
        for (j, trace) in trajectory.traces.iter().enumerate().rev() {
            let Some(lambda) = adjoint.get(j).copied() else {
                continue;
            };
            model.jacobian(trace, &mut jacobian);
            // y(k+j-lag) is the prediction of step j-1-lag.
            let before = adjoint.iter_mut().take(j).rev();
            for (before, by_y) in before.zip(&jacobian.y) {
                for (row, lambda) in by_y.iter().zip(&lambda) {
                    for (before, jac) in before.iter_mut().zip(row) {
                        *before += jac * lambda;
                    }
                }
            }
            for v in 0..NV {
                let x = direction(problem, &slopes, j, v);
                let curved = model.curvature(trace, &lambda, &x);
                for w in 0..=v {
                    let value = inner(&direction(problem, &slopes, j, w), &curved);
                    quadratic.add(v, w, value);
                    if w < v {
                        quadratic.add(w, v, value);
                    }
                }
            }
        }
    }
}

/// dx(k+j)/dv: what the predictor looks at at step `j` of the horizon, by decision variable `v`.
fn direction<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>,
    slopes: &[[[f32; NY]; NV]; N],
    j: usize,
    v: usize,
) -> Regressor<NU, NY, NS, ND, DD> {
    let mut x = Regressor {
        u: [[0.0; NU]; ND],
        y: [[0.0; NY]; DD],
        s: [0.0; NS],
    };
    // The first step's command is the newest; those before it have been applied.
    for (lag, u) in x.u.iter_mut().enumerate().take(j + 1) {
        let Some(Interpolation { block, weight }) =
            problem.horizons.interpolation.get(j - lag).copied()
        else {
            continue;
        };
        let part = if v / NU == block {
            weight
        } else if v / NU + 1 == block {
            1.0 - weight
        } else {
            continue;
        };
        if let Some(u) = u.get_mut(v % NU) {
            *u = part;
        }
    }
    for (y, slopes) in x.y.iter_mut().zip(slopes.iter().take(j).rev()) {
        if let Some(slope) = slopes.get(v) {
            *y = *slope;
        }
    }
    x
}

/// The Jacobian times a direction.
fn along<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>(
    jacobian: &Jacobian<NU, NY, ND, DD>,
    x: &Regressor<NU, NY, NS, ND, DD>,
) -> [f32; NY] {
    let mut y = [0.0; NY];
    for (jac, x) in jacobian.u.iter().zip(&x.u) {
        add_product(&mut y, jac, x);
    }
    for (jac, x) in jacobian.y.iter().zip(&x.y) {
        add_product(&mut y, jac, x);
    }
    y
}

/// `y += a x`.
fn add_product<const R: usize, const C: usize>(y: &mut [f32; R], a: &[[f32; C]; R], x: &[f32; C]) {
    for (y, row) in y.iter_mut().zip(a) {
        for (a, x) in row.iter().zip(x) {
            *y += a * x;
        }
    }
}

/// Inner product over commands and outputs; channels are held.
fn inner<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>(
    a: &Regressor<NU, NY, NS, ND, DD>,
    b: &Regressor<NU, NY, NS, ND, DD>,
) -> f32 {
    let (u, y) = (a.u.as_flattened().iter(), a.y.as_flattened().iter());
    let with = b.u.as_flattened().iter().chain(b.y.as_flattened());
    u.chain(y).zip(with).map(|(a, b)| a * b).sum()
}
