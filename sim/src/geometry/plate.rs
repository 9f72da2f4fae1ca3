//! A plate that rises, rolls and pitches (docs/explanation/geometry.md, eq. 4).

use super::{Pose, chain};
use crate::scalar::Scalar;

/// Pose of a plate: its middle `height + z` above the origin, turned by the rotation vector
/// `(roll, pitch, 0)`.
pub(crate) fn pose<S: Scalar>(height: S, z: S, roll: S, pitch: S) -> Pose<S> {
    // A plate does not twist, as a segment does not: the same rotation, the arc left out.
    let turned = chain::segment(S::ZERO, [roll, pitch]);
    Pose {
        origin: [S::ZERO, S::ZERO, height + z],
        turn: turned.turn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;

    #[test]
    fn a_pitched_plate_leans_a_point_above_it_along_x() {
        let pose = pose(0.03, 0.002, 0.0, 0.2);
        let [x, y, z] = pose.point([0.0, 0.0, 0.05]);
        assert!((x - 0.05 * math::sin(0.2)).abs() < 1e-15 && y == 0.0);
        assert!((z - 0.032 - 0.05 * math::cos(0.2)).abs() < 1e-15);
    }

    /// The rise of a point by eq. 5 is its rise to first order.
    #[test]
    fn a_point_on_it_rises_by_its_arms() {
        use crate::Dual;
        let at = |k| Dual::<3>::variable(0.0, k);
        let pose = pose(Dual::ZERO, at(0), at(1), at(2));
        let point = pose.point([0.03, -0.02, 0.0].map(Dual::constant));
        assert_eq!(point[2].derivative, [1.0, -0.02, -0.03]);
    }
}
