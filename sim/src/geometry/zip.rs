//! A pouch that zips: how far it has contracted, how far its electrodes have closed, how hard it pulls
//! (docs/geometry.md, eq. 7 to 9; Kellaris, Venkata, Rothemund, Keplinger 2019, Extreme Mechanics Letters
//! 29, 100449).

use crate::math;
use crate::scalar::Scalar;

/// Permittivity of vacuum (CODATA 2022), F/m.
pub(crate) const EPSILON_0: f64 = 8.854_187_818_8e-12;

/// A pouch is a full circle beyond the zipped part here: it contracts no further.
const FULL: f64 = std::f64::consts::FRAC_PI_2;

/// Newton steps towards the angle of a contraction; from the start below, five leave rounding only.
const STEPS: usize = 6;

/// Shape of a pouch, all lengths in units of its film length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zip<S> {
    /// Contraction since rest (eq. 7).
    pub(crate) contraction: S,
    /// Film that has zipped, of each side.
    pub(crate) zipped: S,
    /// Slope of `zipped` over `contraction`: `cos a / (1 - cos a)` (eq. 8).
    pub(crate) slope: S,
    /// Slope of `slope` over `contraction`.
    pub(crate) bend: S,
}

/// `2 a - sin 2a`: four times the oil's area over the squared radius of the arcs.
fn lens<S: Scalar>(angle: S) -> S {
    angle * 2.0 - (angle * 2.0).sin()
}

/// Radius of the arcs at an angle, for a pouch that rests at `rest` with nothing zipped: the oil keeps
/// its area.
fn radius<S: Scalar>(rest: S, angle: S) -> S {
    (lens(rest) / lens(angle)).sqrt() / (rest * 2.0)
}

/// How much of the film's length the arcs take up beyond their chords.
fn taken<S: Scalar>(radius: S, angle: S) -> S {
    radius * (angle - angle.sin()) * 2.0
}

impl<S: Scalar> Zip<S> {
    /// A pouch at an angle between `rest` and a right one (eq. 7), and the slope of its contraction over
    /// the angle.
    fn at(rest: S, angle: S) -> (Self, S) {
        let one = S::constant(1.0);
        let r = radius(rest, angle);
        let (sin, cos) = (angle.sin(), angle.cos());
        let open = one - cos;
        // Its root at a = 0 is out of reach, since `rest` is more than zero.
        let growth = r * open * (sin - angle * cos) / (angle - sin * cos) * 2.0;
        let zip = Self {
            contraction: taken(r, angle) - taken(radius(rest, rest), rest),
            zipped: one - angle * r * 2.0,
            slope: cos / open,
            bend: -(sin / (open * open)) / growth,
        };
        (zip, growth)
    }

    /// The pouch that has contracted so far. Beyond either end it goes on straight: stretched, with the
    /// slope of its rest; full, with none.
    pub(crate) fn contracted(rest: S, contraction: S) -> Self {
        let (from, _) = Self::at(rest, rest);
        let (to, _) = Self::at(rest, S::constant(FULL));
        if contraction.value() <= 0.0 {
            return Self {
                contraction,
                zipped: from.slope * contraction,
                slope: from.slope,
                bend: S::ZERO,
            };
        }
        if contraction.value() >= to.contraction.value() {
            return Self {
                contraction,
                zipped: to.zipped,
                slope: S::ZERO,
                bend: S::ZERO,
            };
        }
        let angle = angle(rest.value(), contraction.value(), to.contraction.value());
        // The value is found; one more step in the scalar's own arithmetic finds its derivatives.
        let (there, growth) = Self::at(rest, S::constant(angle));
        let angle = S::constant(angle) + (contraction - there.contraction) / growth;
        Self {
            contraction,
            ..Self::at(rest, angle).0
        }
    }
}

/// The angle at which a pouch has contracted so far, of at most `most`.
fn angle(rest: f64, contraction: f64, most: f64) -> f64 {
    // Contraction goes nearly as the angle to the power 3/2.
    let bottom = taken(radius(rest, rest), rest);
    let root = |x: f64| math::exp(math::ln(x) * (2.0 / 3.0));
    let (low, high) = (root(bottom), root(bottom + most));
    let mut angle = rest + (FULL - rest) * (root(bottom + contraction) - low) / (high - low);
    for _ in 0..STEPS {
        let (here, growth) = Zip::at(rest, angle);
        let step = (contraction - here.contraction) / growth;
        angle = (angle + step).clamp(rest, FULL);
        if step.abs() < 1e-15 {
            break;
        }
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    /// Rest angles and shares of the whole contraction.
    fn places() -> impl Iterator<Item = (f64, f64)> {
        [0.35, 0.7, 1.1].into_iter().flat_map(|rest| {
            let most = Zip::at(rest, FULL).0.contraction;
            [0.02, 0.2, 0.5, 0.8, 0.99].map(|share| (rest, share * most))
        })
    }

    /// The film is as long, and the oil as much, as at rest: solved here by bisection over the angle,
    /// from the geometry alone.
    #[test]
    fn film_and_oil_are_kept() {
        for (rest, contraction) in places() {
            let area = (2.0 * rest - math::sin(2.0 * rest)) / (4.0 * rest * rest);
            let chord_at_rest = math::sin(rest) / rest;
            let (mut low, mut high) = (rest, FULL);
            let shape = |a: f64| {
                let r = math::sqrt(area / (2.0 * a - math::sin(2.0 * a)));
                let zipped = 1.0 - 2.0 * a * r;
                (zipped, chord_at_rest - zipped - 2.0 * r * math::sin(a))
            };
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if shape(middle).1 < contraction {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let (zipped, _) = shape(low);
            let found = Zip::contracted(rest, contraction);
            assert!(
                (found.zipped - zipped).abs() < 1e-13,
                "{rest} {contraction}: {found:?}"
            );
        }
    }

    /// What the published force rests on, cos a / (1 - cos a), is the slope that virtual work asks for.
    #[test]
    fn the_published_force_is_the_slope_of_the_zipped_length() {
        for (rest, contraction) in places() {
            let h = 1e-6;
            let at = |x: f64| Zip::contracted(rest, x);
            let difference = |f: fn(&Zip<f64>) -> f64| {
                (f(&at(contraction + h)) - f(&at(contraction - h))) / (2.0 * h)
            };
            let here = at(contraction);
            assert!(here.slope > 1e-3, "no force, no test");
            let slope = difference(|zip| zip.zipped);
            assert!((here.slope / slope - 1.0).abs() < 1e-7, "{here:?} {slope}");
            let bend = difference(|zip| zip.slope);
            assert!((here.bend / bend - 1.0).abs() < 1e-5, "{here:?} {bend}");
        }
    }

    #[test]
    fn it_goes_on_straight_beyond_its_ends() {
        let most = Zip::at(0.7, FULL).0.contraction;
        for end in [0.0, most] {
            let (before, after) = (
                Zip::contracted(0.7, end - 1e-9),
                Zip::contracted(0.7, end + 1e-9),
            );
            assert!((before.zipped - after.zipped).abs() < 1e-7);
            assert!(
                (before.slope - after.slope).abs() < 1e-6,
                "{before:?} {after:?}"
            );
        }
        assert_eq!(Zip::contracted(0.7, 2.0 * most).slope, 0.0);
    }

    #[test]
    fn derivatives_are_exact() {
        for (rest, contraction) in places() {
            let seeded = [Dual::<2>::variable(rest, 0), Dual::variable(contraction, 1)];
            let exact = Zip::contracted(seeded[0], seeded[1]).slope.derivative;
            let h = 1e-6;
            let at = |dr: f64, dx: f64| Zip::contracted(rest + dr, contraction + dx).slope;
            let of_rest = (at(h, 0.0) - at(-h, 0.0)) / (2.0 * h);
            let plain = Zip::contracted(rest, contraction);
            assert!(
                (exact[0] / of_rest - 1.0).abs() < 1e-5,
                "{exact:?} {of_rest}"
            );
            assert!(
                (exact[1] / plain.bend - 1.0).abs() < 1e-12,
                "{exact:?} {plain:?}"
            );
        }
    }
}
