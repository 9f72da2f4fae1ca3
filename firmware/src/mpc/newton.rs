//! Safeguarded Newton iterations on the plan (docs/mpc.md, section 5).

use super::escape::escape;
use super::{Plan, Problem, Quadratic, qp};
use crate::control_loop::Status;
use crate::model::Model;

/// Largest number of Newton iterations a caller can ask for; with it the work of a step is bounded at
/// compile time.
pub const MAX_ITERATIONS: u8 = 8;

/// Shorter steps tried when the full one does not lower the cost.
const BACKTRACKS: u8 = 2;

/// Part of the decrease promised by the slope that a step has to deliver.
const SUFFICIENT: f32 = 1e-4;

/// A step that promises less than this fraction of J is taken without evaluating J once more: the
/// plan is optimal to within that, whatever the promise is worth.
const CONVERGED: f32 = 1e-4;

/// A step that promises less than this fraction of J, or less than this much at all, is rounding and
/// is not taken: on a flat cost it could be long and gain nothing.
const NOISE: f32 = 1e-7;
const NOISE_ABSOLUTE: f32 = 1e-10;

/// What an optimisation did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub status: Status,
    /// Linearisations.
    pub iterations: u8,
    /// J of the plan that is held now, to within 1e-4 of it; not finite where the status is
    /// [`Status::NotFinite`].
    pub cost: f32,
}

/// Improves `plan` and leaves the best feasible plan found in it.
///
/// The plan is moved inside the limits first; where it has become much dearer than the last one, its
/// surroundings are tried before the search. Each of at most `iterations` (1 to [`MAX_ITERATIONS`])
/// linearisations gives a quadratic subproblem; its solution is taken whole if J then decreases, else
/// in part; a step too small to matter ends the search. Cost: `iterations` linearisations, one
/// evaluation of J and at most two more per iteration; where surroundings are tried `2 NU` evaluations
/// and one linearisation more.
pub fn solve<
    M: Model<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NC: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N>,
    plan: &mut Plan<NV>,
    iterations: u8,
) -> Outcome {
    let outcome = search::<M, NU, NY, NS, ND, DD, N, NC, NV>(problem, plan, iterations);
    plan.cost = outcome.cost;
    outcome
}

#[inline(never)]
fn search<
    M: Model<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NC: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N>,
    plan: &mut Plan<NV>,
    iterations: u8,
) -> Outcome {
    let allowed = iterations.clamp(1, MAX_ITERATIONS);
    problem.bounds.project(&mut plan.u);
    let mut quadratic = Quadratic::new();
    problem.linearise::<NC, NV>(&plan.u, &mut quadratic);
    let mut outcome = Outcome {
        status: Status::IterationLimit,
        iterations: 1,
        cost: quadratic.cost,
    };
    if !outcome.cost.is_finite() {
        outcome.status = Status::NotFinite;
        return outcome;
    }
    if escape(problem, plan, outcome.cost) {
        problem.linearise::<NC, NV>(&plan.u, &mut quadratic);
        outcome.cost = quadratic.cost;
    }
    let mut candidate = plan.u;
    // Every pass but the last adds one linearisation.
    for _ in 0..MAX_ITERATIONS {
        let mut active = plan.active.clone();
        qp::solve(
            &quadratic,
            &problem.bounds,
            &plan.u,
            &mut active,
            &mut candidate,
        );
        let step: [f32; NV] = core::array::from_fn(|v| candidate[v] - plan.u[v]);
        let slope = quadratic.slope(&step);
        let curvature = super::cost::dot(&step, &quadratic.hessian_times(&step));
        let promised = -(slope + curvature);
        if !promised.is_finite() {
            outcome.status = Status::NoDecrease;
            return outcome;
        }
        if promised <= CONVERGED * outcome.cost + NOISE_ABSOLUTE {
            if promised > NOISE * outcome.cost + NOISE_ABSOLUTE {
                plan.u = candidate;
                plan.active = active;
                outcome.cost -= promised;
            }
            outcome.status = Status::Converged;
            return outcome;
        }
        let last = outcome.iterations >= allowed;
        let cost = if last {
            problem.cost(&candidate)
        } else {
            problem.linearise::<NC, NV>(&candidate, &mut quadratic);
            outcome.iterations += 1;
            quadratic.cost
        };
        if cost <= outcome.cost + SUFFICIENT * slope {
            plan.u = candidate;
            plan.active = active;
            outcome.cost = cost;
            if last {
                return outcome;
            }
            continue;
        }
        if !backtrack(problem, plan, &step, slope, cost, &mut outcome) {
            outcome.status = Status::NoDecrease;
            return outcome;
        }
        if outcome.iterations >= allowed {
            return outcome;
        }
        problem.linearise::<NC, NV>(&plan.u, &mut quadratic);
        outcome.iterations += 1;
    }
    outcome
}

/// Takes the part of `step` that lowers J, at the minimum of the parabola through what is known; the
/// limits are convex, so every part is feasible. False: none of the tried parts did, the plan stays.
fn backtrack<
    M: Model<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N>,
    plan: &mut Plan<NV>,
    step: &[f32; NV],
    slope: f32,
    cost_of_step: f32,
    outcome: &mut Outcome,
) -> bool {
    let mut part = 1.0_f32;
    let mut cost = cost_of_step;
    for _ in 0..BACKTRACKS {
        let rise = cost - outcome.cost - slope * part;
        let minimum = -slope * part * part / (2.0 * rise);
        // Written so that a NaN (cost not finite) takes the shortest part.
        part = if minimum > 0.1 * part {
            if minimum < 0.5 * part {
                minimum
            } else {
                0.5 * part
            }
        } else {
            0.1 * part
        };
        let mut shorter: [f32; NV] = core::array::from_fn(|v| plan.u[v] + part * step[v]);
        problem.bounds.project(&mut shorter);
        cost = problem.cost(&shorter);
        if cost <= outcome.cost + SUFFICIENT * part * slope {
            plan.u = shorter;
            outcome.cost = cost;
            return true;
        }
    }
    false
}
