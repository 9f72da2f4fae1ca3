//! The most that one optimisation may do, by its const parameters alone, and what that costs on a
//! chip (docs/explanation/controller.md, section 6).

use crate::active_set::{self, iteration_limit};
pub use crate::budget::Parts;
use crate::budget::{Interrupt, Part};
use crate::constraints::ActiveSet;
use crate::cost::{CostTerm, Quadratic};
use crate::model::Model;
use crate::newton::{BACKTRACKS, MAX_ITERATIONS};
use crate::problem::Problem;
use crate::rollout::Trajectory;

/// Counts of the parts of an optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// Evaluations of J, N predictions each.
    pub rollouts: u32,
    /// Gradients with Hessians.
    pub derivatives: u32,
    /// Factorisations of the quadratic subproblem.
    pub factorisations: u32,
}

impl Work {
    /// The bound for `nu` inputs, `nv` decision variables and so many Newton iterations.
    pub const fn most(iterations: u8, nu: usize, nv: usize) -> Self {
        let iterations = match iterations {
            0 => 1,
            1..=MAX_ITERATIONS => iterations as u32,
            _ => MAX_ITERATIONS as u32,
        };
        // The first; a whole step and its shorter parts; the surroundings and what they gave.
        let rollouts = 1 + iterations * (1 + BACKTRACKS as u32) + 2 * nu as u32 + 1;
        Self {
            rollouts,
            derivatives: iterations,
            factorisations: iterations * iteration_limit(nv) as u32,
        }
    }
}

/// Times of the iterations of a subproblem.
struct Laps<'a, T> {
    ticks: &'a T,
    /// Start of the solution, until its first iteration.
    started: Option<u32>,
    longest_start: u32,
    last: u32,
    longest: u32,
}

impl<T: Fn() -> u32> Interrupt for Laps<'_, T> {
    #[inline(always)]
    fn ends(&mut self, _: Part) -> bool {
        let now = (self.ticks)();
        match self.started.take() {
            Some(start) => self.longest_start = self.longest_start.max(now.wrapping_sub(start)),
            None => self.longest = self.longest.max(now.wrapping_sub(self.last)),
        }
        self.last = now;
        false
    }

    #[inline(always)]
    fn ended(&mut self) -> bool {
        false
    }
}

impl Parts {
    /// Measures at a plan; `ticks` reads a free-running counter that wraps at 32 bits.
    pub fn measure<
        M: CostTerm<NU, NY, NS, ND, DD>,
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
        plan: &[f32; NV],
        ticks: impl Fn() -> u32,
    ) -> Self {
        let mut trajectory = Trajectory::new(M::Model::TRACE, M::RESIDUALS);
        let mut quadratic = Quadratic::new();
        let mut active = ActiveSet::new();
        let mut step = *plan;
        let times = [
            ticks(),
            {
                problem.rollout(plan, &mut trajectory);
                ticks()
            },
            {
                problem.linearise(plan, &trajectory, &mut quadratic);
                let slope = quadratic.slope(plan) + quadratic.curvature(plan);
                core::hint::black_box(slope);
                ticks()
            },
        ];
        let [start, rolled, derived] = times;
        let mut laps = Laps {
            ticks: &ticks,
            started: None,
            longest_start: 0,
            last: derived,
            longest: 0,
        };
        // Cold, then from where that ended, with the limits that are active there.
        for _ in 0..2 {
            let from = step;
            laps.started = Some(ticks());
            let mut guess = active.clone();
            active_set::solve_within(
                &quadratic,
                problem.bounds,
                &from,
                &mut guess,
                &mut step,
                &mut laps,
            );
            active = guess;
            laps.ends(Part::Factorisation);
        }
        Self {
            rollout: rolled.wrapping_sub(start),
            derivative: derived
                .wrapping_sub(rolled)
                .wrapping_add(laps.longest_start),
            factorisation: laps.longest,
        }
    }

    /// The larger of each.
    #[must_use]
    pub fn or_more(self, other: Self) -> Self {
        Self {
            rollout: self.rollout.max(other.rollout),
            derivative: self.derivative.max(other.derivative),
            factorisation: self.factorisation.max(other.factorisation),
        }
    }

    /// Ticks of an optimisation that does all it may.
    pub const fn bound(&self, most: &Work) -> u32 {
        (most.rollouts.saturating_mul(self.rollout))
            .saturating_add(most.derivatives.saturating_mul(self.derivative))
            .saturating_add(most.factorisations.saturating_mul(self.factorisation))
    }
}
