//! How fast the rig can move, and how many sub-steps that takes (docs/plant.md, eq. 14).

use super::{MAX_SUBSTEPS, RATE_STEP};
use crate::effects::{At, Slopes};
use crate::error::SimulationError;
use crate::plant::topology::{State, Topology};

/// Row sums of |M^-1/2 K M^-1/2| and |M^-1/2 C M^-1/2|, an upper bound on their eigenvalues.
struct RowSums<'a> {
    root_inertia: &'a [f64],
    stiffness: Vec<f64>,
    damping: Vec<f64>,
}

impl RowSums<'_> {
    /// Adds `slope * b b^T`, where `b` has the given entries (body, coefficient). The ground has no
    /// row.
    fn add(&mut self, entries: &[(usize, f64)], slopes: Slopes) {
        let scaled = |&(body, coefficient): &(usize, f64)| {
            let root = self.root_inertia.get(body)?;
            Some((body, coefficient.abs() / root))
        };
        let total: f64 = entries.iter().filter_map(scaled).map(|(_, b)| b).sum();
        for (body, b) in entries.iter().filter_map(scaled) {
            self.stiffness[body] += slopes.stiffness * b * total;
            self.damping[body] += slopes.damping * b * total;
        }
    }
}

/// A bound on the largest rate of the rig linearised near a state, 1/s, and the body where it sits.
/// Where a slope grows with position, the position is as far as the velocity takes it in `ahead`
/// seconds.
///
/// With omega^2 and gamma the row sums of stiffness and damping scaled by inertia, an eigenvalue
/// obeys |lambda|^2 <= gamma |lambda| + omega^2, hence
/// |lambda| <= gamma/2 + sqrt(gamma^2/4 + omega^2).
pub(super) fn bound(
    topology: &Topology,
    values: &[f64],
    state: &State<f64>,
    ahead: f64,
) -> (f64, usize) {
    let inertias = topology.bodies.iter().map(|body| values[body.inertia]);
    let root_inertia: Vec<f64> = inertias.map(crate::math::sqrt).collect();
    let bodies = root_inertia.len();
    let mut rows = RowSums {
        root_inertia: &root_inertia,
        stiffness: vec![0.0; bodies],
        damping: vec![0.0; bodies],
    };
    for spring in &topology.springs {
        let extension = state.q[spring.to] - state.q[spring.from] - values[spring.rest];
        let velocity = state.v[spring.to] - state.v[spring.from];
        let at = At {
            position: extension.abs() + velocity.abs() * ahead,
            velocity,
            direction: 0.0,
            motion: spring.motion,
        };
        let mut slopes = Slopes {
            stiffness: values[spring.stiffness].abs(),
            damping: 0.0,
        };
        for law in &spring.laws {
            let more = law.kind.slopes(&values[law.slot..], &at);
            slopes.stiffness += more.stiffness;
            slopes.damping += more.damping;
        }
        rows.add(&[(spring.from, 1.0), (spring.to, 1.0)], slopes);
    }
    for damper in &topology.dampers {
        let slopes = Slopes {
            stiffness: 0.0,
            damping: values[damper.damping].abs(),
        };
        rows.add(&[(damper.from, 1.0), (damper.to, 1.0)], slopes);
    }
    for tendon in &topology.tendons {
        let arms = tendon.path.iter().map(|&(body, arm)| (body, values[arm]));
        let slopes = Slopes {
            stiffness: values[tendon.stiffness].abs(),
            damping: values[tendon.damping].abs(),
        };
        rows.add(&arms.collect::<Vec<_>>(), slopes);
    }
    let loads = topology.loads.iter().map(|l| (l.body, l.motion, l.law));
    let frictions =
        (topology.frictions.iter()).flat_map(|f| f.laws.iter().map(|law| (f.body, f.motion, *law)));
    for (body, motion, law) in loads.chain(frictions) {
        let at = At {
            position: state.q[body],
            velocity: state.v[body],
            direction: 0.0,
            motion,
        };
        rows.add(&[(body, 1.0)], law.kind.slopes(&values[law.slot..], &at));
    }
    // The two maxima may sit at different bodies; the bound needs both, the name only the larger.
    let largest = |rows: &[f64]| rows.iter().copied().fold(0.0, f64::max);
    let (omega2, gamma) = (largest(&rows.stiffness), largest(&rows.damping));
    let of =
        |omega2: f64, gamma: f64| 0.5 * gamma + crate::math::sqrt(0.25 * gamma * gamma + omega2);
    let own = |body: usize| of(rows.stiffness[body], rows.damping[body]);
    let fastest = (0..bodies).max_by(|&a, &b| own(a).total_cmp(&own(b)));
    (of(omega2, gamma), fastest.unwrap_or(0))
}

/// Sub-steps for an interval: the smallest power of two that keeps a sub-step within the rate. A
/// power of two, so that a small change of a parameter seldom changes the number.
pub(super) fn substeps(
    topology: &Topology,
    (rate, body): (f64, usize),
    interval: f64,
) -> Result<usize, SimulationError> {
    let wanted = rate * interval / RATE_STEP;
    if wanted <= MAX_SUBSTEPS as f64 {
        Ok((wanted.ceil() as usize).max(1).next_power_of_two())
    } else {
        Err(SimulationError::TooStiff {
            body: topology.names[body].clone(),
            rate,
            interval,
        })
    }
}
