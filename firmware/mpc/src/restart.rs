//! Coordinate perturbation restart, for plans where the quadratic says nothing
//! (docs/explanation/controller.md, section 5): a device that sticks, or an input in its dead zone,
//! answers a small change by next to nothing, so that the step points far and wrong and its
//! shortened parts gain little, while the reference is leaving.

use crate::budget::{Interrupt, Part};
use crate::cost::{CostTerm, Path};
use crate::problem::{Plan, Problem};

/// A plan whose J has grown by this factor since the last step, and whose quadratic could not be
/// trusted, is distrusted.
pub(crate) const RESTART_RATIO: f32 = 8.0;

/// Distance by which the plan is moved to look further, as a part of the channel's range.
const PERTURBATION: f32 = 0.125;

/// Looks to both sides of a plan of this cost and replaces it by what is better; `false` where
/// it looked at none, for lack of time or of a range. Cost: two evaluations of J a channel.
#[inline(never)]
pub(crate) fn restart<
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
    cost: f32,
    interrupt: &mut impl Interrupt,
) -> bool {
    let mut looked = false;
    let mut least = cost;
    let found = plan.u;
    let bounds = problem.bounds;
    for (channel, (lower, upper)) in bounds.lower.iter().zip(&bounds.upper).enumerate() {
        let range = upper - lower;
        if !range.is_finite() {
            continue;
        }
        for perturbation in [PERTURBATION * range, -PERTURBATION * range] {
            if interrupt.ends(Part::Perturbation) {
                return looked;
            }
            looked = true;
            let mut candidate = found;
            for u in candidate.iter_mut().skip(channel).step_by(NU) {
                *u += perturbation;
            }
            bounds.project(&mut candidate);
            let cost = problem.rollout(&candidate, trajectory);
            if cost < least {
                plan.replace(&candidate);
                least = cost;
            }
        }
    }
    looked
}
