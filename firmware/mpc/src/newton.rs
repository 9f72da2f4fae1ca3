//! Safeguarded Newton iterations on the plan (docs/explanation/controller.md, section 5).

use crate::active_set;
use crate::budget::{Interrupt, Part, Unlimited, Until};
use crate::cost::{CostTerm, Path, Quadratic};
use crate::model::Model;
use crate::problem::{Plan, Problem};
use crate::restart::{RESTART_RATIO, restart};
use crate::rollout::Trajectory;
use crate::status::Status;

/// Largest number of Newton iterations a caller can ask for; with it the work of a step is bounded
/// at compile time.
pub const MAX_ITERATIONS: u8 = 8;

/// Shorter steps tried when the full one does not lower the cost.
pub(crate) const BACKTRACKS: u8 = 2;

/// Fraction of the decrease predicted_reduction by the slope that a step has to deliver.
const SUFFICIENT_DECREASE: f32 = 1e-4;

/// A step that promises less than this fraction of J is taken without evaluating J once more: the
/// plan is optimal to within that, whatever the promise is worth.
const CONVERGED: f32 = 1e-4;

/// A quadratic that has predicted_cost J to within this fraction is right about the rest too:
/// another iteration gains less.
const MODEL_AGREEMENT: f32 = 5e-3;

/// A step that promises less than this fraction of J, or less than this much at all, is rounding
/// and is not taken: on a flat cost it could be long and gain nothing.
const NOISE: f32 = 1e-7;
const NOISE_ABSOLUTE: f32 = 1e-10;

/// Result of an optimisation.
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
/// The plan is moved inside the limits first; where it has become much dearer than the last one,
/// its surroundings are tried before the search. Each of at most `iterations` (1 to
/// [`MAX_ITERATIONS`]) linearisations gives a quadratic subproblem; its solution is taken whole if
/// J then decreases, else in fraction. Where the quadratic has predicted_cost J well, or the step
/// is too small to matter, another iteration would gain next to nothing and is left out. Cost: one
/// evaluation of J and, an iteration, one set of derivatives, one subproblem and at most three
/// evaluations of J; the surroundings cost `2 NU + 1` evaluations and count as an iteration.
#[inline(always)]
pub fn solve<
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
    plan: &mut Plan<NV>,
    iterations: u8,
) -> Outcome {
    solve_within(problem, plan, iterations, &mut Unlimited)
}

/// As [`solve`], until `stop` says so: by a timer, or by a flag that an interrupt sets.
///
/// `stop` is asked before every iteration, factorisation and evaluation of J but the first, and has
/// to stay true. At most one of these, or one set of derivatives, is finished after it became true;
/// after a restart one evaluation more. The status is then [`Status::CutShort`].
#[inline(always)]
pub fn solve_until<
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
    plan: &mut Plan<NV>,
    iterations: u8,
    stop: impl FnMut() -> bool,
) -> Outcome {
    solve_within(problem, plan, iterations, &mut Until(stop))
}

/// As [`solve`], until `interrupt` ends it. It may end at any instant: every plan on the way is
/// inside the limits, and none is dearer than the one before, to within the last step that is not
/// evaluated. Such a step promises next to nothing, or there was no work left to evaluate it
/// ([`Interrupt::UNEVALUATED`]). The status of an optimisation that was cut short is
/// [`Status::CutShort`].
#[inline(never)]
pub fn solve_within<
    M: CostTerm<NU, NY, NS, ND, DD>,
    I: Interrupt,
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
    plan: &mut Plan<NV>,
    iterations: u8,
    interrupt: &mut I,
) -> Outcome {
    let allowed = iterations.clamp(1, MAX_ITERATIONS);
    problem.bounds.project(&mut plan.u);
    // Made by the compiler: one memset.
    let mut trajectory = const { Trajectory::new(M::Model::TRACE, M::RESIDUALS) };
    let mut outcome = Outcome {
        status: Status::IterationLimit,
        iterations: 0,
        cost: problem.rollout(&plan.u, &mut trajectory),
    };
    if !outcome.cost.is_finite() {
        outcome.status = Status::NotFinite;
        return outcome;
    }
    let before = plan.cost;
    let mut restarted = false;
    let mut quadratic = Quadratic::new();
    let mut candidate = plan.u;
    while outcome.iterations < allowed {
        if interrupt.ends(Part::Derivative) {
            outcome.status = Status::CutShort;
            break;
        }
        problem.linearise(&plan.u, &trajectory, &mut quadratic);
        outcome.iterations += 1;
        let mut active = plan.active.clone();
        let subproblem = active_set::solve_within(
            &quadratic,
            problem.bounds,
            &plan.u,
            &mut active,
            &mut candidate,
            interrupt,
        );
        // A subproblem that was cut short says nothing about the optimum.
        let cut = I::LIMITED && !subproblem.optimal;
        let step: [f32; NV] = core::array::from_fn(|v| candidate[v] - plan.u[v]);
        let slope = quadratic.slope(&step);
        let curvature = quadratic.curvature(&step);
        let predicted_reduction = -(slope + curvature);
        if !predicted_reduction.is_finite() {
            outcome.status = Status::NoDecrease;
            break;
        }
        let agrees;
        if predicted_reduction <= CONVERGED * outcome.cost + NOISE_ABSOLUTE {
            // Nothing to gain; where no limit is the reason, it may be that nothing has a slope
            // here.
            agrees = !active.is_empty();
            if predicted_reduction > NOISE * outcome.cost + NOISE_ABSOLUTE {
                plan.u = candidate;
                plan.active = active;
                outcome.cost -= predicted_reduction;
            }
            outcome.status = if cut {
                Status::CutShort
            } else {
                Status::Converged
            };
        } else if interrupt.ends(Part::Rollout) {
            if I::UNEVALUATED {
                plan.u = candidate;
                plan.active = active;
                outcome.cost -= predicted_reduction;
            }
            outcome.status = Status::CutShort;
            break;
        } else {
            let cost = problem.rollout(&candidate, &mut trajectory);
            if cost <= outcome.cost + SUFFICIENT_DECREASE * slope {
                let predicted_cost = outcome.cost - predicted_reduction;
                plan.u = candidate;
                plan.active = active;
                outcome.cost = cost;
                agrees = !cut && (cost - predicted_cost).abs() <= MODEL_AGREEMENT * cost;
                outcome.status = if agrees {
                    Status::Converged
                } else {
                    Status::IterationLimit
                };
            } else {
                agrees = false;
                outcome.status = if line_search(
                    problem,
                    plan,
                    &mut trajectory,
                    &step,
                    slope,
                    cost,
                    &mut outcome,
                    interrupt,
                ) {
                    Status::IterationLimit
                } else if interrupt.ended() {
                    Status::CutShort
                } else {
                    Status::NoDecrease
                };
            }
        }
        if !agrees && !restarted && outcome.cost > RESTART_RATIO * before {
            restarted = true;
            let looked = restart(problem, plan, &mut trajectory, outcome.cost, interrupt);
            if interrupt.ends(Part::Rollout) && !looked {
                outcome.status = Status::CutShort;
                break;
            }
            outcome.cost = problem.rollout(&plan.u, &mut trajectory);
            outcome.status = Status::IterationLimit;
        } else if outcome.status != Status::IterationLimit {
            break;
        }
    }
    plan.cost = outcome.cost;
    outcome
}

/// Takes the fraction of `step` that lowers J, at the minimum of the parabola through what is
/// known; the limits are convex, so every fraction is feasible. False: none of the tried parts did,
/// the plan stays.
#[allow(
    clippy::too_many_arguments,
    reason = "one call; the values are those of the iteration around it"
)]
fn line_search<
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
    plan: &mut Plan<NV>,
    trajectory: &mut Path<M, NU, NY, NS, ND, DD, N>,
    step: &[f32; NV],
    slope: f32,
    cost_of_step: f32,
    outcome: &mut Outcome,
    interrupt: &mut impl Interrupt,
) -> bool {
    let mut fraction = 1.0_f32;
    let mut cost = cost_of_step;
    for _ in 0..BACKTRACKS {
        if interrupt.ends(Part::Rollout) {
            break;
        }
        let rise = cost - outcome.cost - slope * fraction;
        let minimum = -slope * fraction * fraction / (2.0 * rise);
        // Written so that a NaN (cost not finite) takes the shortest fraction.
        fraction = if minimum > 0.1 * fraction {
            if minimum < 0.5 * fraction {
                minimum
            } else {
                0.5 * fraction
            }
        } else {
            0.1 * fraction
        };
        let mut shorter: [f32; NV] = core::array::from_fn(|v| plan.u[v] + fraction * step[v]);
        problem.bounds.project(&mut shorter);
        cost = problem.rollout(&shorter, trajectory);
        if cost <= outcome.cost + SUFFICIENT_DECREASE * fraction * slope {
            plan.u = shorter;
            outcome.cost = cost;
            return true;
        }
    }
    false
}
