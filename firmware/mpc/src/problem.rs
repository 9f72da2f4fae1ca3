//! The optimal control problem and its decision variables (docs/explanation/controller.md, eq. 4).

use crate::constraints::{ActiveSet, Bounds};
use crate::model::Regressor;
use crate::move_blocking::Horizons;

/// Diagonals of Q and Lambda.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights<const NU: usize, const NY: usize> {
    /// Q: on the squared tracking error of each output.
    pub tracking: [f32; NY],
    /// Lambda: on the squared change of each command.
    pub moves: [f32; NU],
}

/// One optimisation: everything that stays the same while a step is computed.
///
/// ```
/// # use sinew_mpc::model::{Jacobian, Model, Regressor};
/// # use sinew_mpc::sensitivity::Propagate;
/// # struct Lag;
/// # impl Model<1, 1, 0, 1, 1> for Lag {
/// #     type Trace = ();
/// #     const TRACE: () = ();
/// #     fn predict(&self, x: &Regressor<1, 1, 0, 1, 1>, _: &mut ()) -> [f32; 1] {
/// #         [0.5 * x.y[0][0] + 0.5 * x.u[0][0]]
/// #     }
/// #     fn jacobian(&self, _: &(), jacobian: &mut Jacobian<1, 1, 1, 1>) {
/// #         jacobian.y[0][0][0] = 0.5;
/// #         jacobian.u[0][0][0] = 0.5;
/// #     }
/// # }
/// # impl sinew_mpc::Tuning for Lag {}
/// # impl Propagate<1, 1, 0, 1, 1> for Lag {}
/// use sinew_mpc::{Bounds, Horizons, Plan, Problem, Status, Weights, solve};
///
/// let bounds = Bounds { lower: [-0.8], upper: [0.8], rate: [1.0], previous: [0.0] };
/// // The model `Lag` is y(k+1) = 0.5 y(k) + 0.5 u(k). 8 steps are predicted, 1 command is free.
/// let problem = Problem {
///     model: &Lag,
///     start: &Regressor { u: [[0.0]], y: [[0.0]], s: [] },
///     disturbance: &[0.0],
///     reference: &[[1.0]; 8],
///     weights: Weights { tracking: [1.0], moves: [0.0] },
///     bounds: &bounds,
///     horizons: &Horizons::new(1, [1]),
/// };
/// let mut plan = Plan::<1>::new();
/// let outcome = solve(&problem, &mut plan, 2);
/// assert_eq!(outcome.status, Status::Converged);
/// assert_eq!(plan.u, [0.8], "the upper limit");
/// ```
#[derive(Clone, Copy)]
pub struct Problem<
    'a,
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> {
    /// The predictor, or a cost term around it.
    pub model: &'a M,
    /// The regressor at k; `start.u[0]` is a place for u(k) and is not read.
    pub start: &'a Regressor<NU, NY, NS, ND, DD>,
    /// Disturbance d, added to every prediction (eq. 10).
    pub disturbance: &'a [f32; NY],
    /// r(k+1) .. r(k+N).
    pub reference: &'a [[f32; NY]; N],
    /// Q and Lambda.
    pub weights: Weights<NU, NY>,
    /// Limits and the last applied command.
    pub bounds: &'a Bounds<NU, NV>,
    /// Prediction horizon, and the blocks of the plan.
    pub horizons: &'a Horizons<N, NB>,
}

/// The decision variables, time-major (`u[b * NU + c]` is channel c at the end of block b), and
/// which limits were active there: what one step hands to the next.
#[derive(Clone, Debug)]
pub struct Plan<const NV: usize> {
    /// Planned commands, model units.
    pub u: [f32; NV],
    /// Limits that hold with equality.
    pub active: ActiveSet<NV>,
    /// J when it was made; infinite before the first.
    pub cost: f32,
}

impl<const NV: usize> Plan<NV> {
    /// All zero, nothing active.
    pub const fn new() -> Self {
        Self {
            u: [0.0; NV],
            active: ActiveSet::new(),
            cost: f32::INFINITY,
        }
    }

    /// Every planned command is `u`.
    pub fn hold<const NU: usize>(&mut self, u: &[f32; NU]) {
        for end in self.u.chunks_exact_mut(NU) {
            for (planned, u) in end.iter_mut().zip(u) {
                *planned = *u;
            }
        }
        self.active = ActiveSet::new();
    }

    /// Another plan, with no limit taken to be active.
    pub(crate) fn replace(&mut self, u: &[f32; NV]) {
        self.u = *u;
        self.active = ActiveSet::new();
    }

    /// Warm start: the plan one step later, held at its end. A part of a feasible plan is feasible.
    pub fn shift<const NU: usize, const N: usize, const NB: usize>(
        &mut self,
        horizons: &Horizons<N, NB>,
    ) {
        for b in 0..NB.saturating_sub(1) {
            // The end of block b, one step later: the first step of the next block.
            let share = match horizons.length.get(b + 1) {
                Some(length) if *length > 1 => 1.0 / f32::from(*length),
                _ => 1.0,
            };
            for v in b * NU..(b + 1) * NU {
                let Some(next) = self.u.get(v + NU).copied() else {
                    continue;
                };
                if let Some(end) = self.u.get_mut(v) {
                    *end = next - (1.0 - share) * (next - *end);
                }
            }
        }
        self.active.shift::<NU, NB>(&horizons.length);
    }

    /// u(k), where the command before it was `previous`.
    pub fn first<const NU: usize, const N: usize, const NB: usize>(
        &self,
        horizons: &Horizons<N, NB>,
        previous: &[f32; NU],
    ) -> [f32; NU] {
        horizons
            .interpolation
            .first()
            .map_or(*previous, |place| place.command(&self.u, previous))
    }
}

impl<const NV: usize> Default for Plan<NV> {
    fn default() -> Self {
        Self::new()
    }
}
