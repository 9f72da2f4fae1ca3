//! The field of a small magnet (docs/explanation/geometry.md, eq. 6).

use super::Vector;
use crate::scalar::Scalar;

/// Vacuum permeability (CODATA 2022) over 4 pi, T m/A.
const MU0_OVER_4PI: f64 = 1.256_637_061_27e-6 / (4.0 * std::f64::consts::PI);

/// Field of a dipole of `moment` A m^2 at the end of `r` m from it, T. Infinite or NaN at the
/// dipole itself.
pub(crate) fn field<S: Scalar>(moment: Vector<S>, r: Vector<S>) -> Vector<S> {
    let dot = |a: Vector<S>, b: Vector<S>| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let square = dot(r, r);
    let along = dot(moment, r) * 3.0 / square;
    let scale = S::constant(MU0_OVER_4PI) / (square * square.sqrt());
    std::array::from_fn(|i| (along * r[i] - moment[i]) * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `magpylib.misc.Dipole(moment=m).getB(r)` of magpylib 6.1.0 (tests/foreign/dipole.py prints
    /// these lines): moment, place, field.
    const MAGPYLIB: &[[Vector<f64>; 3]] = &include!("dipole.magpylib.rs");

    #[test]
    fn the_field_is_magpylibs() {
        assert!(MAGPYLIB.len() >= 6);
        for &[moment, place, expected] in MAGPYLIB {
            let found = field(moment, place);
            let size = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            assert!(size > 1e-9, "the field vanished: this place tests nothing");
            for axis in 0..3 {
                let error = (found[axis] - expected[axis]).abs() / size;
                assert!(error < 1e-12, "{place:?}: {found:?} and not {expected:?}");
            }
        }
    }

    /// On its axis 2 k m / r^3, beside it -k m / r^3.
    #[test]
    fn on_the_axis_it_is_twice_what_it_is_beside() {
        let moment = [0.0, 0.0, 0.5];
        let above = field(moment, [0.0, 0.0, 0.02]);
        let beside = field(moment, [0.02, 0.0, 0.0]);
        assert!((above[2] / 0.0125 - 1.0).abs() < 1e-8);
        assert!((above[2] + 2.0 * beside[2]).abs() < 1e-15);
    }
}
