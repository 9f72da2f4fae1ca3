//! Double precision, and dual numbers over it, nested for second derivatives.

use std::ops::{Add, Div, Mul, Sub};

use crate::math;

/// A number that a network can be evaluated with.
pub trait Real:
    Clone + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A constant.
    fn of(value: f64) -> Self;
    /// The number without its derivatives.
    fn number(&self) -> f64;
    /// Exponential function.
    fn exp(&self) -> Self;
    /// Natural logarithm.
    fn ln(&self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(&self) -> Self;
    /// Square root.
    fn sqrt(&self) -> Self;
    /// Error function.
    fn erf(&self) -> Self;
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn number(&self) -> f64 {
        *self
    }

    fn exp(&self) -> Self {
        math::exp(*self)
    }

    fn ln(&self) -> Self {
        math::ln(*self)
    }

    fn tanh(&self) -> Self {
        math::tanh(*self)
    }

    fn sqrt(&self) -> Self {
        math::sqrt(*self)
    }

    fn erf(&self) -> Self {
        math::erf(*self)
    }
}

/// A number and its derivative along one direction.
///
/// ```
/// use sinew_nn::evaluate::{Dual, Real};
///
/// let x = Dual::new(0.0, 1.0);
/// let y = x.tanh() * Dual::new(3.0, 0.0);
/// assert_eq!((y.value, y.tangent), (0.0, 3.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T> {
    /// The number.
    pub value: T,
    /// Its derivative.
    pub tangent: T,
}

impl<T: Real> Dual<T> {
    /// A number with its derivative.
    pub fn new(value: T, tangent: T) -> Self {
        Self { value, tangent }
    }

    /// `f(self)` from f and its slope there.
    fn chain(&self, value: T, slope: T) -> Self {
        Self::new(value, slope * self.tangent.clone())
    }
}

impl<T: Real> Add for Dual<T> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.tangent + other.tangent)
    }
}

impl<T: Real> Sub for Dual<T> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.tangent - other.tangent)
    }
}

impl<T: Real> Mul for Dual<T> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let tangent = self.tangent * other.value.clone() + self.value.clone() * other.tangent;
        Self::new(self.value * other.value, tangent)
    }
}

impl<T: Real> Div for Dual<T> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value.clone();
        let tangent = (self.tangent - value.clone() * other.tangent) / other.value;
        Self::new(value, tangent)
    }
}

impl<T: Real> Real for Dual<T> {
    fn of(value: f64) -> Self {
        Self::new(T::of(value), T::of(0.0))
    }

    fn number(&self) -> f64 {
        self.value.number()
    }

    fn exp(&self) -> Self {
        let value = self.value.exp();
        self.chain(value.clone(), value)
    }

    fn ln(&self) -> Self {
        self.chain(self.value.ln(), T::of(1.0) / self.value.clone())
    }

    fn tanh(&self) -> Self {
        let value = self.value.tanh();
        self.chain(value.clone(), T::of(1.0) - value.clone() * value)
    }

    fn sqrt(&self) -> Self {
        let value = self.value.sqrt();
        self.chain(value.clone(), T::of(0.5) / value)
    }

    fn erf(&self) -> Self {
        let x = self.value.clone();
        let bell = (T::of(0.0) - x.clone() * x).exp();
        self.chain(
            self.value.erf(),
            bell * T::of(std::f64::consts::FRAC_2_SQRT_PI),
        )
    }
}
