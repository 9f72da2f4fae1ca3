//! The number that the plant computes with: a plain `f64`, or one that carries derivatives.

use crate::math;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number in a simulation: `f64`, [`crate::Dual`], or a complex step in a test.
///
/// Contract: every branch of the simulator is taken on [`Scalar::value`], and the value of each
/// operation is the `f64` operation on the values. A simulation that carries derivatives therefore
/// takes the same path, to the bit, as the plain one (`tests/simulator/derivatives.rs` holds it to
/// that).
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// Zero, with zero derivatives.
    const ZERO: Self;

    /// A number that depends on nothing.
    fn constant(value: f64) -> Self;

    /// The number without its derivatives.
    fn value(self) -> f64;

    /// True where every derivative is known to be zero, so that results of such numbers alone need
    /// none.
    fn is_constant(self) -> bool {
        false
    }

    /// Sine of an angle in radians.
    fn sin(self) -> Self;

    /// Cosine of an angle in radians.
    fn cos(self) -> Self;

    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    /// Natural exponential.
    fn exp(self) -> Self;

    /// Natural logarithm; NaN below zero.
    fn ln(self) -> Self;

    /// Hyperbolic tangent.
    fn tanh(self) -> Self;

    /// Square root; its derivative is infinite at zero.
    fn sqrt(self) -> Self;

    /// Magnitude; at zero its derivative is that of the positive side.
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// The larger by value; `self` where they are equal.
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() {
            other
        } else {
            self
        }
    }

    /// The smaller by value; `self` where they are equal.
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() {
            other
        } else {
            self
        }
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;

    fn constant(value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn is_constant(self) -> bool {
        true
    }

    fn sin(self) -> Self {
        math::sin(self)
    }

    fn cos(self) -> Self {
        math::cos(self)
    }

    fn sin_cos(self) -> (Self, Self) {
        math::sin_cos(self)
    }

    fn exp(self) -> Self {
        math::exp(self)
    }

    fn ln(self) -> Self {
        math::ln(self)
    }

    fn tanh(self) -> Self {
        math::tanh(self)
    }

    fn sqrt(self) -> Self {
        math::sqrt(self)
    }
}
