//! Learned laws of springs and dampers: the shape that every one of them has by construction
//! (docs/explanation/plant.md, eq. 12e and 12f).

use crate::scalar::Scalar;

/// Fewest and most numbers of one side of a law.
pub(crate) const NUMBERS: [usize; 2] = [2, 33];

/// Component that a law is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawKind {
    /// Force over the extension; the numbers are stiffnesses, straight over its square.
    Spring,
    /// Force over the rate; the numbers are dampings, straight over its magnitude.
    Damper,
}

impl LawKind {
    /// Key of its numbers in a file: `stiffness` or `damping`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Spring => "stiffness",
            Self::Damper => "damping",
        }
    }

    /// Its component: `spring` or `damper`.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Spring => "spring",
            Self::Damper => "damper",
        }
    }

    /// Integral, over the distance `y` behind a knot at `from`, of what the slope multiplies.
    #[inline]
    fn area<S: Scalar>(self, from: f64, y: S) -> S {
        match self {
            Self::Spring => y * y * (y / 3.0 + from),
            Self::Damper => y * y * 0.5,
        }
    }

    /// Distance between two places in the quantity over which the numbers are straight.
    #[inline]
    fn apart(self, from: f64, to: f64) -> f64 {
        match self {
            Self::Spring => (to - from) * (to + from),
            Self::Damper => to - from,
        }
    }
}

/// Shape of a learned law. Its force is the integral of its numbers from rest on, so that it is
/// zero at rest whatever they are.
///
/// With numbers of zero or more the force rises with its argument: a spring has one rest and its
/// potential has no maximum, and a damper only takes energy out. A spring conserves energy with
/// any numbers.
///
/// ```
/// use sinew_sim::{LawKind, LawShape};
/// let shape = LawShape { kind: LawKind::Spring, odd: true, reach: 0.1, length: 1.0, width: 1.0 };
/// // Equal stiffnesses are a linear spring.
/// assert!((shape.resistance(&[40.0, 40.0, 40.0], -0.05) + 2.0).abs() < 1e-12);
/// assert_eq!(shape.places(3), [0.0, 0.05, 0.1]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawShape {
    /// Spring or damper.
    pub kind: LawKind,
    /// One list serves both directions: the force of `-x` is that of `x`, reversed.
    pub odd: bool,
    /// Largest magnitude of the argument that has a number; m, rad, m/s or rad/s.
    pub reach: f64,
    /// Length beside that of the piece that the law was learned on.
    pub length: f64,
    /// Width (area across) beside that of the piece that the law was learned on.
    pub width: f64,
}

impl LawShape {
    /// Steps from rest to the reach for this many numbers.
    pub fn steps(&self, numbers: usize) -> usize {
        if self.odd {
            numbers.saturating_sub(1)
        } else {
            numbers.saturating_sub(1) / 2
        }
    }

    /// Largest argument with a number on this piece.
    pub(crate) fn met(&self) -> f64 {
        self.reach * self.length
    }

    /// Arguments at which the numbers hold, on a piece as long as the one that it was learned on.
    pub fn places(&self, numbers: usize) -> Vec<f64> {
        let steps = self.steps(numbers);
        let first = if self.odd { 0.0 } else { -(steps as f64) };
        (0..numbers)
            .map(|k| (first + k as f64) * self.reach / steps as f64)
            .collect()
    }

    /// Force against the argument `x` (an extension or a rate): integral of the numbers (eq. 12e).
    #[inline]
    pub fn resistance<S: Scalar>(&self, numbers: &[S], x: S) -> S {
        let steps = self.steps(numbers.len());
        let minus = x.value() < 0.0;
        let at = |k: usize| match (self.odd, minus) {
            (true, _) => numbers[k],
            (false, true) => numbers[steps - k],
            (false, false) => numbers[steps + k],
        };
        let far = (if minus { -x } else { x }) / self.length;
        let step = self.reach / steps as f64;
        let mut sum = S::ZERO;
        for cell in 0..steps {
            let (from, to) = (step * cell as f64, step * (cell + 1) as f64);
            let slope = (at(cell + 1) - at(cell)) / self.kind.apart(from, to);
            let whole = far.value() >= to;
            let y = if whole {
                S::constant(to - from)
            } else {
                far - from
            };
            sum += at(cell) * y + slope * self.kind.area(from, y);
            if !whole {
                return self.directed(sum, minus);
            }
        }
        // Beyond: the last number and, where they rise, their last slope.
        let slope = at(steps) - at(steps - 1);
        let slope = slope / self.kind.apart(self.reach - step, self.reach);
        let y = far - self.reach;
        sum += at(steps).max(S::ZERO) * y + slope.max(S::ZERO) * self.kind.area(self.reach, y);
        self.directed(sum, minus)
    }

    #[inline]
    fn directed<S: Scalar>(&self, sum: S, minus: bool) -> S {
        let force = sum * self.width;
        if minus { -force } else { force }
    }

    /// Largest magnitude of the slope of [`Self::resistance`] for arguments up to `most` on both
    /// sides.
    pub fn steepest(&self, numbers: &[f64], most: f64) -> f64 {
        let steps = self.steps(numbers.len());
        let far = most.abs() / self.length;
        let step = self.reach / steps as f64;
        let inside = ((far / step).ceil()).clamp(1.0, steps as f64) as usize;
        let side = |at: &dyn Fn(usize) -> f64| {
            let met = (0..=inside).map(|k| at(k).abs()).fold(0.0, f64::max);
            if far <= self.reach {
                return met;
            }
            let rise = (at(steps) - at(steps - 1)).max(0.0);
            let rise = rise / self.kind.apart(self.reach - step, self.reach);
            let there = at(steps).max(0.0) + rise * self.kind.apart(self.reach, far);
            met.max(there)
        };
        let largest = if self.odd {
            side(&|k| numbers[k])
        } else {
            side(&|k| numbers[steps + k]).max(side(&|k| numbers[steps - k]))
        };
        largest * self.width / self.length
    }
}

/// A law in a plant: its shape and the slots of its numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    pub(crate) shape: LawShape,
    pub(crate) slot: usize,
    pub(crate) count: usize,
}

impl Curve {
    #[inline]
    pub(crate) fn resistance<S: Scalar>(&self, values: &[S], x: S) -> S {
        self.shape
            .resistance(&values[self.slot..self.slot + self.count], x)
    }

    pub(crate) fn steepest(&self, values: &[f64], most: f64) -> f64 {
        self.shape
            .steepest(&values[self.slot..self.slot + self.count], most)
    }
}

#[cfg(test)]
mod tests;
