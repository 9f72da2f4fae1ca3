//! Contraction with a rate that is known before the first step (docs/explanation/plant.md, eq. 29).
//!
//! The stiffness is a sum over elements, each with bounds on its own. Their sums bound it for every
//! state: `mu P <= K <= P`. Where a bound is missing (a law that hardens without end, a HASEL
//! actuator, a law of a program) there is no certificate.

use super::balance::Balance;
use super::symmetric::Decomposition;
use crate::effects::Kind;
use crate::math::ln;
use crate::plant::topology::{Load, Topology};
use crate::unit::Motion;

/// Share of the first error that is left after the certified number of steps.
const LEFT: f64 = 1e-12;
/// Bounds on the stiffness closer than this are one: the forces are linear.
const LINEAR: f64 = 1e-12;
/// Most steps that a certificate may ask for.
const MOST_STEPS: f64 = 1e6;

/// Certificate that the rest is the only one, and how fast the contraction reaches it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contraction {
    /// Factor by which a step reduces the error at least, in the norm of the bound `P`.
    pub rate: f64,
    /// Steps after which no more than 1e-12 of the first error is left.
    pub steps: usize,
}

/// Bounds on the stiffness of a plant for every state.
pub(super) struct Bounds {
    upper: Decomposition,
    mu: f64,
}

impl Bounds {
    /// `None` where an element has no bound, or the lower bound leaves a direction free.
    pub(super) fn of(topology: &Topology, values: &[f64]) -> Option<Self> {
        let n = topology.bodies.len();
        if !topology.hasels.is_empty() {
            return None;
        }
        let mut sums = [vec![0.0; n * n], vec![0.0; n * n]];
        let mut add = |path: &[(usize, f64)], bounds: [f64; 2]| {
            for (sum, bound) in sums.iter_mut().zip(bounds) {
                for &(row, a) in path.iter().filter(|entry| entry.0 < n) {
                    for &(column, b) in path.iter().filter(|entry| entry.0 < n) {
                        sum[row * n + column] += a * bound * b;
                    }
                }
            }
        };
        for spring in &topology.springs {
            if spring.curve.is_some() || !spring.laws.iter().all(|law| law.kind == Kind::Viscous) {
                return None;
            }
            let k = values[spring.stiffness];
            let low = if spring.gap.is_some() { 0.0 } else { k };
            add(
                &[(spring.from, -1.0), (spring.to, 1.0)],
                [low.min(k), k.max(low)],
            );
        }
        for tendon in &topology.tendons {
            let path: Vec<_> = (tendon.path.iter())
                .map(|&(body, arm)| (body, values[arm]))
                .collect();
            let k = values[tendon.stiffness];
            let always = tendon.unilateral.is_none() && tendon.gap.is_none();
            let low = if always { k } else { 0.0 };
            add(&path, [low.min(k), k.max(low)]);
        }
        for line in &topology.lines {
            if let Some(servo) = line.servo {
                let k = values[line.gain];
                let always = servo.dead_band.is_none() && servo.limit.is_none();
                let low = if always { k } else { 0.0 };
                add(&[(servo.body, 1.0)], [low.min(k), k.max(low)]);
            }
        }
        for stop in &topology.stops {
            add(&[(stop.body, 1.0)], [0.0, values[stop.slot + 1].max(0.0)]);
        }
        for load in &topology.loads {
            let size = softening(load, values)?;
            add(&[(load.body, 1.0)], [-size, size]);
        }
        let upper = Decomposition::of(&sums[1], n);
        if !upper.values.iter().all(|&value| value > LINEAR) {
            return None;
        }
        let mu = upper.least_beside(&sums[0]).min(1.0);
        (mu > LINEAR).then_some(Self { upper, mu })
    }

    /// Rate of the step `2 / (mu + 1)`, and the steps that it certifies.
    pub(super) fn certificate(&self) -> Contraction {
        let rate = (1.0 - self.mu) / (1.0 + self.mu);
        let steps = if rate < LINEAR {
            1.0
        } else {
            (ln(LEFT) / ln(rate)).ceil()
        };
        Contraction {
            rate,
            steps: steps.clamp(1.0, MOST_STEPS) as usize,
        }
    }

    /// Position after one step of the contraction.
    pub(super) fn step(&self, balance: &mut Balance<'_, f64>, q: &[f64]) -> Vec<f64> {
        let force = balance.forces(q);
        let length = 2.0 / (1.0 + self.mu);
        let moved = self.upper.apply(&force, |value| length / value);
        q.iter().zip(moved).map(|(q, step)| q + step).collect()
    }
}

/// Bound on the stiffness that a load adds or takes, N/m or N m/rad.
fn softening(load: &Load, values: &[f64]) -> Option<f64> {
    let p = &values[load.law.slot..];
    match (load.law.kind, load.motion) {
        (Kind::Gravity, Motion::Hinge) => Some(p[0].abs()),
        (Kind::PositionRipple, _) => Some((p[0] * p[1]).abs()),
        (Kind::Gravity | Kind::Constant | Kind::Viscous | Kind::QuadraticDrag, _) => Some(0.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Balance, Bounds};
    use crate::{Plant, Rig};

    /// Two antagonistic tendons that may go slack, a stop and a spring.
    const FINGER: &str = "format = \"sinew-rig/1\"\nname = \"finger\"\n\
        [[body]]\nname = \"joint\"\nmotion = \"hinge\"\ninertia = 0.001\n\
        [[body]]\nname = \"load\"\nmotion = \"hinge\"\ninertia = 0.001\n\
        [[spring]]\nname = \"back\"\nfrom = \"ground\"\nto = \"joint\"\nstiffness = 0.2\n\
        [[spring]]\nname = \"link\"\nfrom = \"joint\"\nto = \"load\"\nstiffness = 0.3\n\
        [[tendon]]\nname = \"flexor\"\npath = [{ body = \"joint\", arm = 0.01 }, \
        { body = \"load\", arm = 0.005 }]\nstiffness = 4000.0\npretension = 1.0\n\
        [[tendon]]\nname = \"extensor\"\npath = [{ body = \"joint\", arm = -0.01 }]\n\
        stiffness = 4000.0\npretension = 1.0\n\
        [[actuator]]\nname = \"motor\"\ndrives = \"flexor\"\ninput = \"u_m\"\ngain = -1.0\n\
        [[effect]]\nkind = \"end_stop\"\ncomponent = \"load\"\nposition = 0.1\nstiffness = 2.0\n\
        damping = 0.0\nside = 1.0\n";

    #[test]
    fn the_contraction_never_needs_more_than_its_certified_steps() {
        let plant = Plant::new(&Rig::parse(FINGER, "finger.toml").unwrap()).unwrap();
        let values = plant.values();
        let bounds = Bounds::of(&plant.topology, &values).expect("every element has bounds");
        let certificate = bounds.certificate();
        for input in [-0.004, 0.0, 0.001, 0.003, 0.01] {
            let rest = plant.rest(&values, &[input], &[0.0; 4]).unwrap();
            let goal = &rest.state[..2];
            let mut balance = Balance::new(&plant.topology, &values, &[input], None);
            let error = |q: &[f64]| -> f64 {
                // The norm of P, by its eigenvectors.
                let off: Vec<f64> = q.iter().zip(goal).map(|(q, goal)| q - goal).collect();
                let p = upper(&plant, &values);
                let rows = p.chunks_exact(2).zip(&off);
                let square: f64 = rows
                    .map(|(row, off_row)| off_row * (row[0] * off[0] + row[1] * off[1]))
                    .sum();
                square.sqrt()
            };
            let mut q = vec![0.3, -0.2];
            let first = error(&q);
            let (mut needed, mut last) = (0, first);
            for step in 1..=certificate.steps {
                q = bounds.step(&mut balance, &q);
                let now = error(&q);
                let rounding = 1e-13 * first;
                assert!(
                    now <= certificate.rate * last + rounding,
                    "{now:e} after {last:e}"
                );
                last = now;
                if now > 1e-12 * first {
                    needed = step + 1;
                }
            }
            assert!(
                needed <= certificate.steps,
                "{needed} of {}",
                certificate.steps
            );
        }
    }

    /// The bound P, as the rig has it: all tendons taut, the stop pressed.
    fn upper(plant: &Plant, values: &[f64]) -> Vec<f64> {
        let slot = |name: &str| values[plant.slot(name).expect("a parameter of the rig")];
        let (back, link) = (slot("back.stiffness"), slot("link.stiffness"));
        let (flexor, extensor) = (slot("flexor.stiffness"), slot("extensor.stiffness"));
        let off = -link + flexor * 0.01 * 0.005;
        vec![
            back + link + (flexor + extensor) * 1e-4,
            off,
            off,
            link + flexor * 0.005 * 0.005 + 2.0,
        ]
    }
}
