//! Segments of constant curvature, end to end (docs/explanation/geometry.md, eq. 1 and 2).

use super::Pose;
use crate::scalar::Scalar;

/// Below this squared angle the closed forms lose digits to cancellation and their series have all
/// of them: the first term left out is 2e-17 of the sum.
const SERIES: f64 = 0.1;

/// `sin a / a`, `(1 - cos a) / a^2` of the squared angle `s = a^2`, smooth through zero, where the
/// root of a dual number has no slope.
fn quotients<S: Scalar>(s: S) -> (S, S) {
    if s.value() < SERIES {
        let series = |first: f64| {
            // sum (-s)^k / (2k + first)!, by Horner; `first` is 1 for the sine and 2 for the
            // cosine.
            let ratio = |k: f64| (2.0 * k + first) * (2.0 * k + first - 1.0);
            let mut sum = S::constant(1.0);
            for k in (1..=6).rev() {
                sum = S::constant(1.0) - s * sum * (1.0 / ratio(f64::from(k)));
            }
            sum * (1.0 / first)
        };
        (series(1.0), series(2.0))
    } else {
        let angle = s.sqrt();
        (angle.sin() / angle, (S::constant(1.0) - angle.cos()) / s)
    }
}

/// The far end of one segment seen from its near end, where it sets out along z: bent by the
/// rotation vector `(x, y, 0)`, rad, with a middle line of `length` m (eq. 1).
pub(crate) fn segment<S: Scalar>(length: S, [x, y]: [S; 2]) -> Pose<S> {
    let s = x * x + y * y;
    let (sinc, versine) = quotients(s);
    let one = S::constant(1.0);
    Pose {
        origin: [length * versine * y, -(length * versine * x), length * sinc],
        turn: [
            [one - versine * y * y, versine * x * y, sinc * y],
            [versine * x * y, one - versine * x * x, -(sinc * x)],
            [-(sinc * y), sinc * x, one - versine * s],
        ],
    }
}

/// The tip of a chain of equal segments that sets out from the origin along z (eq. 2).
pub(crate) fn tip<S: Scalar>(length: S, bends: impl ExactSizeIterator<Item = [S; 2]>) -> Pose<S> {
    let each = length * (1.0 / bends.len() as f64);
    bends.fold(Pose::world(), |pose, bend| pose.then(&segment(each, bend)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;

    fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max)
    }

    /// Webster and Jones 2010, eq. 2: an arc of curvature kappa, length l, in the plane at angle
    /// phi.
    #[test]
    fn one_segment_is_a_circular_arc() {
        for bend in [1e-9, 1e-3, 0.3, 0.3163, 1.0, 2.5] {
            for phi in [0.0, 0.4, 2.0, -1.3] {
                let (kappa, length) = (bend / 0.1, 0.1);
                let out = if bend < 1e-6 {
                    0.5 * kappa * length * length
                } else {
                    (1.0 - math::cos(kappa * length)) / kappa
                };
                let expected = [
                    out * math::cos(phi),
                    out * math::sin(phi),
                    math::sin(kappa * length) / kappa,
                ];
                // Bending towards phi turns about the axis at right angles to it.
                let turn = [-bend * math::sin(phi), bend * math::cos(phi)];
                let found = segment(length, turn).origin;
                assert!(distance(found, expected) < 1e-14, "{bend} {phi}: {found:?}");
            }
        }
    }

    #[test]
    fn equal_segments_are_one_long_one() {
        let whole = segment(0.1, [0.9, -0.6]);
        let parts = tip(0.1, (0..7).map(|_| [0.9 / 7.0, -0.6 / 7.0]));
        assert!(distance(whole.origin, parts.origin) < 1e-15);
        for row in 0..3 {
            assert!(distance(whole.turn[row], parts.turn[row]) < 1e-14);
        }
    }

    #[test]
    fn the_slope_at_rest_is_half_the_length() {
        use crate::Dual;
        let bend = |k: usize| Dual::<2>::variable(0.0, k);
        let tip = segment(Dual::constant(0.1), [bend(0), bend(1)]).origin;
        assert!((tip[1].derivative[0] + 0.05).abs() < 1e-16);
        assert!((tip[0].derivative[1] - 0.05).abs() < 1e-16);
        assert!(tip[2].derivative[0].abs() < 1e-16);
    }
}
