//! A problem of the controller, drawn.

use sinew_mpc::cost::CostTerm;
use sinew_mpc::model::{Model, Regressor};
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::{Bounds, Horizons, Problem, Quadratic, Weights};

use super::random::Random;

/// Range of the draws.
#[derive(Clone, Copy)]
pub struct Reach {
    /// Of references. What Gauss-Newton leaves out grows with the error.
    pub reference: f32,
    /// Of sensor channels, or of what a recurrent network remembers.
    pub channels: f32,
    /// Of the move suppression.
    pub moves: f32,
}

/// References far away: the exact Hessian differs.
pub const FAR: Reach = Reach {
    reference: 2.0,
    channels: 0.8,
    moves: 0.2,
};
/// Of a recurrent network. No move suppression: it would hide what comes through the memory.
pub const REMEMBERED: Reach = Reach {
    reference: 1.0,
    channels: 0.5,
    moves: 0.0,
};

/// Parts that a [`Problem`] borrows, and a plan at which to look at it.
pub struct Case<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NV: usize,
> {
    /// History.
    pub start: Regressor<NU, NY, NS, ND, DD>,
    /// One row for each step.
    pub reference: [[f32; NY]; N],
    /// Of the outputs.
    pub disturbance: [f32; NY],
    /// Limits, wide, and the command before.
    pub bounds: Bounds<NU, NV>,
    /// Q and Lambda.
    pub weights: Weights<NU, NY>,
    /// Plan at which J is looked at.
    pub plan: [f32; NV],
}

impl<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NV: usize,
> Case<NU, NY, NS, ND, DD, N, NV>
{
    /// The next one.
    pub fn draw(random: &mut Random, reach: Reach) -> Self {
        Self {
            start: Regressor {
                u: random.matrix(0.8),
                y: random.matrix(0.8),
                s: random.array(reach.channels),
            },
            reference: random.matrix(reach.reference),
            disturbance: random.array(0.1),
            bounds: Bounds {
                lower: [-1.0; NU],
                upper: [1.0; NU],
                rate: [f32::INFINITY; NV],
                previous: random.array(0.5),
            },
            weights: Weights {
                tracking: core::array::from_fn(|_| 0.2 + random.unit()),
                moves: core::array::from_fn(|_| reach.moves * random.unit()),
            },
            plan: random.array(0.8),
        }
    }

    /// The problem with `model` as predictor.
    pub fn problem<'a, M: CostTerm<NU, NY, NS, ND, DD>, const NB: usize>(
        &'a self,
        model: &'a M,
        horizons: &'a Horizons<N, NB>,
    ) -> Problem<'a, M, NU, NY, NS, ND, DD, N, NB, NV> {
        Problem {
            model,
            start: &self.start,
            disturbance: &self.disturbance,
            reference: &self.reference,
            weights: self.weights,
            bounds: &self.bounds,
            horizons,
        }
    }

    /// J at the plan, half of its gradient, and half of its Hessian as `model` gives it.
    pub fn derive<M: CostTerm<NU, NY, NS, ND, DD>, const NB: usize>(
        &self,
        model: &M,
        horizons: &Horizons<N, NB>,
    ) -> (f32, Quadratic<NV>) {
        let problem = self.problem(model, horizons);
        let mut trajectory = Trajectory::new(M::Model::TRACE, M::RESIDUALS);
        let mut quadratic = Quadratic::new();
        let cost = problem.rollout(&self.plan, &mut trajectory);
        problem.linearise(&self.plan, &trajectory, &mut quadratic);
        (cost, quadratic)
    }
}
