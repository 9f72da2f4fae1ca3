//! Newton-Raphson model predictive control (docs/mpc.md).
//!
//! minimise over U = (u(k) .. u(k+NC-1)), held after NC,
//! J = sum_{j=1..N} e_j' Q e_j + sum_{i=0..NC-1} du_i' Lambda du_i, e_j = y(k+j) - r(k+j),
//! subject to lower <= u_i <= upper and |du_i| <= rate (eq. 4).
//!
//! [`prediction`] rolls the model out, [`cost`] adds J up and its derivatives, [`qp`] finds the best
//! step inside the limits, [`newton`] decides how much of it to take. Everything is in model units.

pub mod constraint;
pub mod cost;
mod escape;
pub mod factor;
pub mod newton;
pub mod prediction;
pub mod qp;

pub use constraint::{ActiveSet, Bounds};
pub use cost::{Quadratic, Weights};
pub use newton::{MAX_ITERATIONS, Outcome, solve};

use crate::model::Regressor;

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
    pub bounds: Bounds<NU>,
}

/// The decision variables, time-major (`u[i * NU + c]` is channel c at k+i), and which limits were
/// active there: what one step hands to the next.
#[derive(Clone, Debug)]
pub struct Plan<const NV: usize> {
    /// Planned commands, model units.
    pub u: [f32; NV],
    /// Limits that hold with equality.
    pub active: ActiveSet<NV>,
    /// J when it was made; 0 before the first.
    pub cost: f32,
}

impl<const NV: usize> Plan<NV> {
    /// All zero, nothing active.
    pub const fn new() -> Self {
        Self {
            u: [0.0; NV],
            active: ActiveSet::new(),
            cost: 0.0,
        }
    }

    /// Every planned command is `u`.
    pub fn hold<const NU: usize>(&mut self, u: &[f32; NU]) {
        for step in self.u.chunks_exact_mut(NU) {
            for (planned, u) in step.iter_mut().zip(u) {
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

    /// Warm start: the plan one step later, its last command repeated.
    pub fn shift<const NU: usize>(&mut self) {
        self.u.copy_within(NU.., 0);
        self.active.shift::<NU>();
    }

    /// The first command.
    pub fn first<const NU: usize>(&self) -> [f32; NU] {
        let mut u = [0.0; NU];
        for (u, planned) in u.iter_mut().zip(&self.u) {
            *u = *planned;
        }
        u
    }
}

impl<const NV: usize> Default for Plan<NV> {
    fn default() -> Self {
        Self::new()
    }
}
