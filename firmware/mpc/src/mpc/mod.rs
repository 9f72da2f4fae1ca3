//! Newton-Raphson model predictive control (docs/explanation/controller.md).
//!
//! minimise over the commands u(k) .. u(k+Nc-1), held after that,
//! J = sum_{j=N1..N} e_j' Q e_j + sum_{i=0..Nc-1} du_i' Lambda du_i, e_j = y(k+j) - r(k+j),
//! subject to lower <= u_i <= upper and |du_i| <= rate (eq. 4).
//!
//! [`horizons`] describes the commands by few numbers, [`cost`] rolls the model out and adds J up and
//! its derivatives ([`tangent`], a step at a time), [`qp`] finds the best step inside the limits,
//! [`newton`] decides how much of it to take. [`exact`] and [`barrier`] are options. Everything is in model units.

pub mod barrier;
pub mod constraint;
pub mod cost;
mod escape;
pub mod exact;
pub mod factor;
pub mod horizons;
pub mod newton;
pub mod prediction;
pub mod qp;
pub mod tangent;
pub mod work;

pub use constraint::{ActiveSet, Bounds};
pub use cost::{Quadratic, Weights};
pub use horizons::Horizons;
pub use newton::{MAX_ITERATIONS, Outcome, solve};
pub use work::{Parts, Work};

use crate::model::Regressor;

/// What an option around a model hands on to the model, `self.0`.
macro_rules! hand_on {
    () => {
        type Trace = M::Trace;
        const TRACE: Self::Trace = M::TRACE;
        const PREDICTS_CHANNELS: bool = M::PREDICTS_CHANNELS;
        const COMMAND_WEIGHT: f32 = M::COMMAND_WEIGHT;
        const OBSERVER_GAIN: f32 = M::OBSERVER_GAIN;

        fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>, trace: &mut Self::Trace) -> [f32; NY] {
            self.0.predict(x, trace)
        }

        fn jacobian(&self, trace: &Self::Trace, jacobian: &mut Jacobian<NU, NY, ND, DD>) {
            self.0.jacobian(trace, jacobian);
        }

        fn channels(&self, x: &Regressor<NU, NY, NS, ND, DD>, trace: &Self::Trace) -> [f32; NS] {
            self.0.channels(x, trace)
        }

        fn channel_jacobian(
            &self,
            trace: &Self::Trace,
            jacobian: &mut ChannelJacobian<NU, NY, NS, ND, DD>,
        ) {
            self.0.channel_jacobian(trace, jacobian);
        }

        fn advance(
            &self,
            x: &mut Regressor<NU, NY, NS, ND, DD>,
            u: &[f32; NU],
            disturbance: &[f32; NY],
            trace: &mut Self::Trace,
        ) -> [f32; NY] {
            self.0.advance(x, u, disturbance, trace)
        }

        fn carry(
            &self,
            trace: &Self::Trace,
            stage: &Stage<'_, NY>,
            tangent: &mut Tangent<'_, NU, NY, DD>,
        ) {
            self.0.carry(trace, stage, tangent);
        }

        fn carry_channels(
            &self,
            trace: &Self::Trace,
            stage: &Stage<'_, NY>,
            tangent: &mut Tangent<'_, NU, NY, DD>,
            channels: &mut [[[f32; NU]; NS]],
        ) {
            self.0.carry_channels(trace, stage, tangent, channels);
        }
    };
}
use hand_on;

/// One optimisation: everything that stays the same while a step is computed.
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
    /// The predictor.
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
    /// Which steps count, and the blocks of the plan.
    pub horizons: &'a Horizons<N, NB>,
}

/// The decision variables, time-major (`u[b * NU + c]` is channel c at the end of block b), and which
/// limits were active there: what one step hands to the next.
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
                if let (Some(end), Some(next)) =
                    (self.u.get(v).copied(), self.u.get(v + NU).copied())
                    && let Some(place) = self.u.get_mut(v)
                {
                    *place = next - (1.0 - share) * (next - end);
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
            .place
            .first()
            .map_or(*previous, |place| place.command(&self.u, previous))
    }
}

impl<const NV: usize> Default for Plan<NV> {
    fn default() -> Self {
        Self::new()
    }
}
