//! Stiffness of springs, as a joint or a fixed tendon takes it.

use sinew_sim::effects::Kind;
use sinew_sim::rig::{End, Rig, Site};

use super::law::polynomial;
use super::{effect, value};

/// Linear, quadratic and cubic stiffness of a spring.
pub(super) fn coil(rig: &Rig, index: usize) -> [f64; 3] {
    let site = Site::Spring(index);
    let spring = &rig.springs[index];
    let own = match &spring.law {
        Some(applied) => polynomial(rig, &spring.name, applied).coefficients,
        None => [spring.stiffness.value, 0.0, 0.0],
    };
    [
        own[0],
        own[1] + value(rig, Kind::Quadratic, site, 0),
        own[2] + value(rig, Kind::Cubic, site, 0),
    ]
}

/// Linear and quadratic damping of a damper.
pub(super) fn pot(rig: &Rig, index: usize) -> [f64; 2] {
    let damper = &rig.dampers[index];
    match &damper.law {
        Some(applied) => {
            let [linear, drag, _] = polynomial(rig, &damper.name, applied).coefficients;
            [linear, drag]
        }
        None => [damper.damping.value, 0.0],
    }
}

/// The first spring between a body and the ground that a joint can stand for: one without a dead
/// band.
pub(super) fn ground_spring(rig: &Rig, body: usize) -> Option<usize> {
    (0..rig.springs.len()).find(|&index| {
        let spring = &rig.springs[index];
        ends_at_ground(spring.from, spring.to, body)
            && effect(rig, Kind::Backlash, Site::Spring(index)).is_none()
    })
}

pub(super) fn ends_at_ground(from: End, to: End, body: usize) -> bool {
    [(from, to), (to, from)].contains(&(End::Ground, End::Body(body)))
}

/// A polynomial without the zeros at its end: older readers take one number only.
pub(super) fn trimmed(coefficients: [f64; 3]) -> Vec<f64> {
    let last = coefficients.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    coefficients[..=last].to_vec()
}
