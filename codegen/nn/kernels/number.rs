//! The numbers that a network can be computed with: `f32`, and `f32` with one derivative.

use core::ops::{Add, Mul, Neg, Sub};

/// Number that the layers compute with.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Nought.
    const ZERO: Self;

    /// A number that depends on nothing.
    fn constant(value: f32) -> Self;

    /// Without its derivative.
    fn value(self) -> f32;

    /// `weight * self`.
    fn weigh(self, weight: f32) -> Self;

    /// `f(self)`, where `value` is f and `slope` its derivative there.
    fn apply(self, value: f32, slope: f32) -> Self;
}

impl Number for f32 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn constant(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self
    }

    #[inline(always)]
    fn weigh(self, weight: f32) -> Self {
        weight * self
    }

    #[inline(always)]
    fn apply(self, value: f32, _slope: f32) -> Self {
        value
    }
}

/// A number and its derivative along one direction: `value + tangent eps` with `eps^2 = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    /// The number.
    pub value: f32,
    /// Its derivative.
    pub tangent: f32,
}

impl Add for Dual {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            tangent: self.tangent + other.tangent,
        }
    }
}

impl Sub for Dual {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            tangent: self.tangent - other.tangent,
        }
    }
}

impl Mul for Dual {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            tangent: self.tangent * other.value + self.value * other.tangent,
        }
    }
}

impl Neg for Dual {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            tangent: -self.tangent,
        }
    }
}

impl Number for Dual {
    const ZERO: Self = Self {
        value: 0.0,
        tangent: 0.0,
    };

    #[inline(always)]
    fn constant(value: f32) -> Self {
        Self {
            value,
            tangent: 0.0,
        }
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self.value
    }

    #[inline(always)]
    fn weigh(self, weight: f32) -> Self {
        Self {
            value: weight * self.value,
            tangent: weight * self.tangent,
        }
    }

    #[inline(always)]
    fn apply(self, value: f32, slope: f32) -> Self {
        Self {
            value,
            tangent: slope * self.tangent,
        }
    }
}
