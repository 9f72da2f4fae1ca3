//! Newton's method on the balance of forces (docs/explanation/plant.md, eq. 28).
//!
//! A step goes downhill in potential energy whatever the curvature: directions that push are taken
//! with the magnitude of their stiffness, directions without any by a length that grows. The
//! energy itself is not asked for: the slope of it along a step is minus the force (Hager and
//! Zhang 2005, approximate Wolfe conditions).

use super::SEEDS;
use super::balance::Balance;
use super::contraction::{Bounds, Contraction};
use super::symmetric::Decomposition;
use crate::dual::Dual;
use crate::effects::Kind;
use crate::error::NoRest;
use crate::plant::topology::Topology;
use crate::unit::Motion;

/// Most Newton steps.
const MOST_STEPS: usize = 120;
/// Most positions that are tried along a step.
const MOST_TRIALS: usize = 40;
/// Scaled eigenvalues up to this are none.
const FLAT: f64 = 1e-12;
/// A remaining step this small beside the position is taken, and the last.
const RELATIVE: f64 = 1e-11;
/// The same beside nothing, m or rad.
const ABSOLUTE: f64 = 1e-14;
/// First step along a direction without stiffness, m or rad; doubled each time.
const FLAT_STEP: f64 = 1e-3;
/// Distance at which a body that nothing holds is given up, m or rad.
const FAR: f64 = 1e6;
/// Slope of the energy after a step, upwards, as a share of the slope before it.
const OVERSHOOT: f64 = 0.1;
/// Most slope downhill that a shortened step may leave.
const UNDERSHOOT: f64 = 0.5;

/// Result of a search.
pub(super) struct Found {
    pub(super) q: Vec<f64>,
    pub(super) steps: usize,
    pub(super) evaluations: usize,
    pub(super) contraction: Option<Contraction>,
    pub(super) fallback: bool,
}

/// Reason for which there is no rest, and at which body.
type Failure = (usize, NoRest);

/// Forces of a plant, plain and with derivatives.
pub(super) struct Search<'a> {
    pub(super) topology: &'a Topology,
    pub(super) balance: Balance<'a, f64>,
    pub(super) slopes: Balance<'a, Dual<SEEDS>>,
}

impl Search<'_> {
    /// Searches from `start`; certified where bounds are known and `certify` asks for them.
    pub(super) fn run(&mut self, start: &[f64], certify: bool) -> Result<Found, Failure> {
        let bounds = certify
            .then(|| Bounds::of(self.topology, self.balance.values()))
            .flatten();
        let outcome = self.newton(start);
        let (q, steps, fallback) = match (outcome, &bounds) {
            (Ok((q, steps)), _) => (q, steps, false),
            (Err(_), Some(bounds)) => {
                let certificate = bounds.certificate();
                let mut q = start.to_vec();
                for _ in 0..certificate.steps {
                    q = bounds.step(&mut self.balance, &q);
                }
                (q, certificate.steps, true)
            }
            (Err(failure), None) => return Err(failure),
        };
        Ok(Found {
            q,
            steps,
            evaluations: self.balance.evaluations,
            contraction: bounds.map(|bounds| bounds.certificate()),
            fallback,
        })
    }

    fn stiffness(&mut self, q: &[f64]) -> Decomposition {
        self.balance.evaluations += q.len() + 1;
        Decomposition::of(&self.slopes.stiffness(q), q.len())
    }

    fn newton(&mut self, start: &[f64]) -> Result<(Vec<f64>, usize), Failure> {
        let mut q = start.to_vec();
        let mut force = self.balance.forces(&q);
        let mut branches = self.balance.branches().to_vec();
        let mut flat_step = FLAT_STEP;
        let mut largest = 0.0f64;
        for steps in 1..=MOST_STEPS {
            if !force.iter().all(|force| force.is_finite()) {
                break;
            }
            let stiffness = self.stiffness(&q);
            let size = (0..q.len()).map(|k| stiffness.component(k, &force).abs());
            largest = size.fold(largest, f64::max);
            let mut step = stiffness.apply(&force, |value| {
                if value.abs() > FLAT {
                    1.0 / value.abs()
                } else {
                    0.0
                }
            });
            let flat = self.flat(&stiffness, &force, largest);
            if let Some(direction) = &flat {
                if flat_step > FAR {
                    return Err((widest(direction), NoRest::Free));
                }
                let most = direction
                    .iter()
                    .fold(0.0f64, |most, part| most.max(part.abs()));
                for (step, part) in step.iter_mut().zip(direction) {
                    *step += part * flat_step / most;
                }
                flat_step *= 2.0;
            }
            let whole = self.shorten(&mut step);
            if flat.is_none() && small(&step, &q) {
                stable(&stiffness)?;
                advance(&mut q, &step, 1.0);
                return Ok((q, steps));
            }
            let (share, after) = self.line_search(&q, &step, &force);
            advance(&mut q, &step, share);
            force = after;
            let same = self.balance.branches() == branches;
            branches.copy_from_slice(self.balance.branches());
            // With the stiffness of the step before, the rest of the way is known.
            if self.is_straight() && same && whole && flat.is_none() {
                let rest = stiffness.apply(&force, |value| 1.0 / value);
                if rest.iter().all(|part| part.is_finite()) && small(&rest, &q) {
                    stable(&stiffness)?;
                    advance(&mut q, &rest, 1.0);
                    return Ok((q, steps));
                }
            }
        }
        let lost = force
            .iter()
            .map(|force| if force.is_finite() { force.abs() } else { FAR });
        let lost: Vec<f64> = lost.collect();
        Err((widest(&lost), NoRest::NotFound { steps: MOST_STEPS }))
    }

    /// Force along directions without stiffness, if there is one beyond rounding.
    fn flat(&self, stiffness: &Decomposition, force: &[f64], largest: f64) -> Option<Vec<f64>> {
        let mut direction = vec![0.0; force.len()];
        let mut pushed = false;
        for (k, value) in stiffness.values.iter().enumerate() {
            let along = stiffness.component(k, force);
            if value.abs() <= FLAT && along.abs() > FLAT * largest {
                pushed = true;
                for (sum, part) in direction.iter_mut().zip(stiffness.direction(k)) {
                    *sum += along * part;
                }
            }
        }
        pushed.then_some(direction)
    }

    /// True where the forces are linear while no law changes its branch.
    fn is_straight(&self) -> bool {
        let topology = self.topology;
        let straight = |kind: Kind, motion: Motion| kind.straight(motion);
        topology.hasels.is_empty()
            && (topology.loads.iter()).all(|load| straight(load.law.kind, load.motion))
            && (topology.springs.iter()).all(|spring| {
                spring.curve.is_none()
                    && (spring.laws.iter()).all(|law| straight(law.kind, spring.motion))
            })
    }

    /// Shortens a step that would pass more than a radian of a wave; true where it is whole.
    fn shorten(&self, step: &mut [f64]) -> bool {
        let mut share = 1.0f64;
        for load in &self.topology.loads {
            let reach = match (load.law.kind, load.motion) {
                (Kind::Gravity, Motion::Hinge) => 1.0,
                (Kind::PositionRipple, _) => {
                    1.0 / self.balance.values()[load.law.slot + 1]
                        .abs()
                        .max(f64::MIN_POSITIVE)
                }
                _ => continue,
            };
            let length = step[load.body].abs();
            if length > reach {
                share = share.min(reach / length);
            }
        }
        step.iter_mut().for_each(|part| *part *= share);
        share == 1.0
    }

    /// Share of a step at which the energy no longer falls much, and the forces there.
    fn line_search(&mut self, q: &[f64], step: &[f64], force: &[f64]) -> (f64, Vec<f64>) {
        let slope =
            |force: &[f64]| -> f64 { -force.iter().zip(step).map(|(f, d)| f * d).sum::<f64>() };
        let before = slope(force).abs();
        let (mut low, mut at_low) = (0.0, -before);
        let (mut high, mut at_high) = (f64::INFINITY, f64::INFINITY);
        let mut share = 1.0;
        let mut after = force.to_vec();
        for _ in 0..MOST_TRIALS {
            let mut trial = q.to_vec();
            advance(&mut trial, step, share);
            after = self.balance.forces(&trial);
            let here = slope(&after);
            if here.is_finite() && here <= OVERSHOOT * before {
                if share == 1.0 || here >= -UNDERSHOOT * before {
                    break;
                }
                (low, at_low) = (share, here);
            } else {
                (high, at_high) = (share, here);
            }
            // The zero of the secant, kept inside the bracket.
            let secant = if at_high.is_finite() {
                low - at_low * (high - low) / (at_high - at_low)
            } else {
                0.5 * (low + high)
            };
            let margin = 0.1 * (high - low);
            share = secant.clamp(low + margin, high - margin);
        }
        (share, after)
    }
}

fn advance(q: &mut [f64], step: &[f64], share: f64) {
    for (q, step) in q.iter_mut().zip(step) {
        *q += share * step;
    }
}

/// True where a step is rounding, or next to it.
fn small(step: &[f64], q: &[f64]) -> bool {
    let far = q.iter().fold(0.0f64, |far, q| far.max(q.abs()));
    let limit = |q: f64| RELATIVE * q.abs().max(1e-3 * far) + ABSOLUTE;
    step.iter().zip(q).all(|(step, &q)| step.abs() <= limit(q))
}

/// Refuses a balance that a small push leaves, or that nothing holds.
fn stable(stiffness: &Decomposition) -> Result<(), Failure> {
    let mut least = (f64::INFINITY, 0);
    for (k, &value) in stiffness.values.iter().enumerate() {
        if value < least.0 {
            least = (value, k);
        }
    }
    let reason = match least.0 {
        value if value < -FLAT => NoRest::Unstable,
        value if value <= FLAT => NoRest::Free,
        _ => return Ok(()),
    };
    Err((widest(&stiffness.direction(least.1)), reason))
}

/// Index of the largest entry.
fn widest(direction: &[f64]) -> usize {
    let entries = direction.iter().enumerate();
    let largest = entries.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    largest.map_or(0, |(index, _)| index)
}
