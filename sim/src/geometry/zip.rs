//! A pouch that zips: how far it has contracted, how far its electrodes have closed, how hard it
//! pulls (docs/explanation/geometry.md, eq. 7 to 9; Kellaris, Venkata, Rothemund, Keplinger 2019,
//! Extreme Mechanics Letters 29, 100449).

use crate::math;
use crate::scalar::Scalar;

/// Permittivity of vacuum (CODATA 2022), F/m.
pub(crate) const EPSILON_0: f64 = 8.854_187_818_8e-12;

/// A pouch is a full circle beyond the zipped part here: it contracts no further.
const FULL: f64 = std::f64::consts::FRAC_PI_2;

/// Most Newton steps towards the angle of a contraction; from the start below one does.
const STEPS: usize = 12;

/// A step this small leaves an error of about its square.
const CLOSE: f64 = 1e-6;

/// Chebyshev coefficients of the angle over the contraction, for where to begin.
const TERMS: usize = 12;

/// Number of constants of a pouch.
pub(crate) const NUMBERS: usize = 4 + TERMS;

/// Shape of a pouch, all lengths in units of its film length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zip<S> {
    /// Contraction since rest (eq. 7).
    pub(crate) contraction: S,
    /// Film that has zipped, of each side.
    pub(crate) zipped: S,
    /// Slope of `zipped` over `contraction`: `cos a / (1 - cos a)` (eq. 8).
    pub(crate) slope: S,
    /// Slope of `slope` over `contraction`; its own derivatives are not those of the contraction.
    pub(crate) bend: S,
}

/// Constants that follow from the rest angle of a pouch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pouch<S> {
    /// Half the angle of its arcs where nothing is zipped, rad.
    rest: S,
    /// Radius of the arcs times the root of [`lens`]: the oil keeps its area.
    oil: S,
    /// Share of the film in the arcs at rest.
    bottom: S,
    /// The largest contraction, and what is zipped there.
    most: S,
    zipped: S,
    /// The angle over the contraction, nearly.
    search: [f64; TERMS],
}

/// `2 a - sin 2a`: four times the oil's area over the squared radius of the arcs.
fn lens<S: Scalar>(angle: S, (sin, cos): (S, S)) -> S {
    (angle - sin * cos) * 2.0
}

/// Share of the film's length in the arcs beyond their chords.
fn taken<S: Scalar>(radius: S, angle: S, sin: S) -> S {
    radius * (angle - sin) * 2.0
}

impl<S: Scalar> Pouch<S> {
    /// A pouch that rests at this angle, more than zero.
    pub(crate) fn new(rest: S) -> Self {
        let (sin, cos) = rest.sin_cos();
        let lens = lens(rest, (sin, cos)).sqrt();
        let oil = lens / (rest * 2.0);
        let mut pouch = Self {
            rest,
            oil,
            bottom: taken(oil / lens, rest, sin),
            most: S::ZERO,
            zipped: S::ZERO,
            search: [0.0; TERMS],
        };
        let (full, _) = pouch.at(S::constant(FULL));
        pouch.most = full.contraction;
        pouch.zipped = full.zipped;
        pouch.search = pouch.plain().chebyshev();
        pouch
    }

    /// Its constants, for slots behind the parameters.
    pub(crate) fn numbers(&self) -> [S; NUMBERS] {
        let mut numbers = [S::ZERO; NUMBERS];
        numbers[..4].copy_from_slice(&[self.oil, self.bottom, self.most, self.zipped]);
        numbers[4..].copy_from_slice(&self.search.map(S::constant));
        numbers
    }

    /// From its rest angle and [`Pouch::numbers`].
    pub(crate) fn kept(rest: S, numbers: &[S]) -> Self {
        Self {
            rest,
            oil: numbers[0],
            bottom: numbers[1],
            most: numbers[2],
            zipped: numbers[3],
            search: std::array::from_fn(|term| numbers[4 + term].value()),
        }
    }

    /// At an angle between its rest and a right one (eq. 7), and the slope of its contraction over
    /// the angle.
    fn at(&self, angle: S) -> (Zip<S>, S) {
        let one = S::constant(1.0);
        let (sin, cos) = angle.sin_cos();
        let lens = lens(angle, (sin, cos));
        let r = self.oil / lens.sqrt();
        let open = one - cos;
        // Its root at a = 0 is out of reach, since `rest` is more than zero.
        let growth = r * open * (sin - angle * cos) / lens * 4.0;
        let zip = Zip {
            contraction: taken(r, angle, sin) - self.bottom,
            zipped: one - angle * r * 2.0,
            slope: cos / open,
            bend: -(sin / (open * open)) / growth,
        };
        (zip, growth)
    }

    /// [`Pouch::at`] an angle without derivatives; most rigs hold the fill angle, and nothing there
    /// has any.
    fn there(&self, angle: f64) -> (Zip<S>, f64) {
        if [self.rest, self.oil, self.bottom]
            .into_iter()
            .all(S::is_constant)
        {
            let (zip, growth) = self.plain().at(angle);
            let zip = Zip {
                contraction: S::constant(zip.contraction),
                zipped: S::constant(zip.zipped),
                slope: S::constant(zip.slope),
                bend: S::constant(zip.bend),
            };
            return (zip, growth);
        }
        let (zip, growth) = self.at(S::constant(angle));
        (zip, growth.value())
    }

    /// Having contracted so far. Beyond either end it goes on straight: stretched, with the slope
    /// of its rest; full, with none.
    pub(crate) fn contracted(&self, contraction: S) -> Zip<S> {
        if contraction.value() <= 0.0 {
            let cos = self.rest.cos();
            let slope = cos / (S::constant(1.0) - cos);
            return Zip {
                contraction,
                zipped: slope * contraction,
                slope,
                bend: S::ZERO,
            };
        }
        if contraction.value() >= self.most.value() {
            return Zip {
                contraction,
                zipped: self.zipped,
                slope: S::ZERO,
                bend: S::ZERO,
            };
        }
        let begun = self.begin(contraction.value());
        let (mut there, growth) = self.there(begun);
        let mut beyond = contraction - there.contraction;
        if beyond.value().abs() > CLOSE * growth {
            let angle = self.plain().improved(contraction.value(), begun);
            there = self.there(angle).0;
            beyond = contraction - there.contraction;
        }
        // The value is all but found: along the curve's tangents for the rest, and for the
        // derivatives.
        Zip {
            contraction,
            zipped: there.zipped + beyond * (there.slope + beyond * there.bend * 0.5),
            slope: there.slope + beyond * there.bend,
            bend: there.bend,
        }
    }

    /// The angle of a contraction, nearly (Clenshaw's sum).
    fn begin(&self, contraction: f64) -> f64 {
        let x = 2.0 * contraction / self.most.value() - 1.0;
        let (mut b1, mut b2) = (0.0, 0.0);
        for term in self.search[1..].iter().rev() {
            (b1, b2) = (term + 2.0 * x * b1 - b2, b1);
        }
        let angle = self.search[0] + x * b1 - b2;
        angle.clamp(self.rest.value(), FULL)
    }

    /// The same without derivatives.
    fn plain(&self) -> Pouch<f64> {
        Pouch {
            rest: self.rest.value(),
            oil: self.oil.value(),
            bottom: self.bottom.value(),
            most: self.most.value(),
            zipped: self.zipped.value(),
            search: self.search,
        }
    }
}

impl Pouch<f64> {
    /// Coefficients of the angle over the contraction, from the angles at the roots of the next
    /// term.
    fn chebyshev(&self) -> [f64; TERMS] {
        let place = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / TERMS as f64;
        let angles: [f64; TERMS] = std::array::from_fn(|k| {
            let share = 0.5 * (1.0 + math::cos(place(k)));
            self.improved(share * self.most, self.rest + share * (FULL - self.rest))
        });
        std::array::from_fn(|term| {
            let part = |(k, angle): (usize, &f64)| angle * math::cos(term as f64 * place(k));
            let sum: f64 = angles.iter().enumerate().map(part).sum();
            sum * if term == 0 { 1.0 } else { 2.0 } / TERMS as f64
        })
    }

    /// The angle at which it has contracted so far, to about the square of [`CLOSE`].
    fn improved(&self, contraction: f64, from: f64) -> f64 {
        let mut angle = from;
        for _ in 0..STEPS {
            let (here, growth) = self.at(angle);
            let step = (contraction - here.contraction) / growth;
            angle = (angle + step).clamp(self.rest, FULL);
            if step.abs() < CLOSE {
                break;
            }
        }
        angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    /// Rest angles and shares of the whole contraction.
    fn places() -> impl Iterator<Item = (f64, f64)> {
        [0.35, 0.7, 1.1].into_iter().flat_map(|rest| {
            let most = Pouch::new(rest).most;
            [0.02, 0.2, 0.5, 0.8, 0.99].map(|share| (rest, share * most))
        })
    }

    /// The film is as long, and the oil as much, as at rest: solved here by bisection over the
    /// angle, from the geometry alone.
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
            let found = Pouch::new(rest).contracted(contraction);
            assert!(
                (found.zipped - zipped).abs() < 1e-13,
                "{rest} {contraction}: {found:?}"
            );
        }
    }

    /// The published force's factor cos a / (1 - cos a) is the slope that virtual work asks for.
    #[test]
    fn the_published_force_is_the_slope_of_the_zipped_length() {
        for (rest, contraction) in places() {
            let h = 1e-6;
            let at = |x: f64| Pouch::new(rest).contracted(x);
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
        let most = Pouch::new(0.7).most;
        for end in [0.0, most] {
            let (before, after) = (
                Pouch::new(0.7).contracted(end - 1e-9),
                Pouch::new(0.7).contracted(end + 1e-9),
            );
            assert!((before.zipped - after.zipped).abs() < 1e-7);
            assert!(
                (before.slope - after.slope).abs() < 1e-6,
                "{before:?} {after:?}"
            );
        }
        assert_eq!(Pouch::new(0.7).contracted(2.0 * most).slope, 0.0);
    }

    #[test]
    fn derivatives_are_exact() {
        for (rest, contraction) in places() {
            let seeded = [Dual::<2>::variable(rest, 0), Dual::variable(contraction, 1)];
            let exact = Pouch::new(seeded[0]).contracted(seeded[1]).slope.derivative;
            let h = 1e-6;
            let at = |dr: f64, dx: f64| Pouch::new(rest + dr).contracted(contraction + dx).slope;
            let of_rest = (at(h, 0.0) - at(-h, 0.0)) / (2.0 * h);
            let plain = Pouch::new(rest).contracted(contraction);
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
