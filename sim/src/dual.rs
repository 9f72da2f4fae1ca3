//! First derivatives carried along: a value and its gradient with respect to `N` seeds.

use crate::math;
use crate::scalar::Scalar;
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A dual number `x + sum_i d_i e_i` with `e_i e_j = 0` (docs/explanation/plant.md, eq. 20).
///
/// Cost of a product: `2 N + 1` multiplications. Comparisons look at the value alone.
///
/// ```
/// use sinew_sim::{Dual, Scalar};
/// let x = Dual::<2>::variable(3.0, 0);
/// let y = Dual::<2>::variable(2.0, 1);
/// let z = x * x * y + y.sin();
/// assert_eq!(z.derivative, [12.0, 9.0 + 2f64.cos()]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// The number itself.
    pub value: f64,
    /// Its partial derivatives with respect to the `N` seeds.
    pub derivative: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Seed number `index`: derivative one with respect to itself.
    ///
    /// # Panics
    /// When `index` is not below `N`.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut derivative = [0.0; N];
        derivative[index] = 1.0;
        Self { value, derivative }
    }

    /// `f(self)`, given the value `f` and the slope `f'` there (chain rule).
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            derivative: self.derivative.map(|d| d * slope),
        }
    }

    #[inline(always)]
    fn zip(a: [f64; N], b: [f64; N], f: impl Fn(f64, f64) -> f64) -> [f64; N] {
        std::array::from_fn(|i| f(a[i], b[i]))
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const ZERO: Self = Self {
        value: 0.0,
        derivative: [0.0; N],
    };

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self {
            value,
            derivative: [0.0; N],
        }
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn is_constant(self) -> bool {
        self.derivative.iter().all(|d| *d == 0.0)
    }

    fn sin(self) -> Self {
        self.chain(math::sin(self.value), math::cos(self.value))
    }

    fn cos(self) -> Self {
        self.chain(math::cos(self.value), -math::sin(self.value))
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = math::sin_cos(self.value);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    fn exp(self) -> Self {
        let value = math::exp(self.value);
        self.chain(value, value)
    }

    fn ln(self) -> Self {
        self.chain(math::ln(self.value), 1.0 / self.value)
    }

    fn tanh(self) -> Self {
        let value = math::tanh(self.value);
        self.chain(value, 1.0 - value * value)
    }

    fn sqrt(self) -> Self {
        let value = math::sqrt(self.value);
        self.chain(value, 0.5 / value)
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            derivative: self.derivative.map(|d| -d),
        }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            derivative: Self::zip(self.derivative, other.derivative, |a, b| a + b),
        }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            derivative: Self::zip(self.derivative, other.derivative, |a, b| a - b),
        }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[allow(
        clippy::suspicious_arithmetic_impl,
        reason = "the product rule is a sum"
    )]
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            derivative: Self::zip(self.derivative, other.derivative, |a, b| {
                a * other.value + self.value * b
            }),
        }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let inverse = 1.0 / other.value;
        Self {
            value,
            derivative: Self::zip(self.derivative, other.derivative, |a, b| {
                (a - value * b) * inverse
            }),
        }
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self {
            value: self.value + other,
            ..self
        }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Self {
            value: self.value - other,
            ..self
        }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self {
            value: self.value * other,
            derivative: self.derivative.map(|d| d * other),
        }
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        Self {
            value: self.value / other,
            derivative: self.derivative.map(|d| d / other),
        }
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
