//! A time step for MuJoCo that the rig's fastest motion allows.

use sinew_sim::effects::Kind;
use sinew_sim::rig::{Drives, End, Rig, Site};

use super::value;

/// The usual step; halved until it is short enough.
const USUAL: f64 = 1e-3;

/// A step times the fastest rate: a classical Runge-Kutta step is then good to some parts in a
/// million.
const FINENESS: f64 = 0.1;

/// 1 ms, halved until the fastest rate of the linearised rig is resolved (the bound of
/// docs/explanation/plant.md, eq. 19).
pub(super) fn timestep(rig: &Rig) -> f64 {
    let mut stiffness = vec![0.0; rig.bodies.len()];
    let mut damping = vec![0.0; rig.bodies.len()];
    for (index, spring) in rig.springs.iter().enumerate() {
        let c = value(rig, Kind::Viscous, Site::Spring(index), 0);
        for body in ends([spring.from, spring.to]) {
            stiffness[body] += rig.steepest_stiffness(index);
            damping[body] += c;
        }
    }
    for (index, damper) in rig.dampers.iter().enumerate() {
        for body in ends([damper.from, damper.to]) {
            damping[body] += rig.steepest_damping(index);
        }
    }
    for tendon in &rig.tendons {
        let arms = tendon.arms(rig);
        let reach: f64 = arms.iter().map(|(_, arm)| arm.abs()).sum();
        for (body, arm) in arms {
            stiffness[body] += arm.abs() * reach * tendon.stiffness.value;
            damping[body] += arm.abs() * reach * tendon.damping.value;
        }
    }
    for actuator in &rig.actuators {
        if let (Some(_), Drives::Body(body)) = (&actuator.position_loop, actuator.drives) {
            stiffness[body] += actuator.gain.value.abs();
        }
    }
    for body in 0..rig.bodies.len() {
        let site = Site::Body(body);
        stiffness[body] +=
            value(rig, Kind::EndStop, site, 1) + value(rig, Kind::HiddenMode, site, 1);
        damping[body] += value(rig, Kind::EndStop, site, 2)
            + value(rig, Kind::HiddenMode, site, 2)
            + value(rig, Kind::Viscous, site, 0);
    }
    let fastest = (rig.bodies.iter())
        .zip(stiffness.iter().zip(&damping))
        .map(|(body, (k, c))| {
            // Row sums of both ends: twice the diagonal.
            let (omega2, gamma) = (2.0 * k / body.inertia.value, 2.0 * c / body.inertia.value);
            0.5 * gamma + (0.25 * gamma * gamma + omega2).sqrt()
        })
        .fold(0.0, f64::max);
    let mut step = USUAL;
    while step * fastest > FINENESS && step > 1e-9 {
        step *= 0.5;
    }
    step
}

fn ends(ends: [End; 2]) -> impl Iterator<Item = usize> {
    ends.into_iter().filter_map(|end| match end {
        End::Body(body) => Some(body),
        End::Ground => None,
    })
}
