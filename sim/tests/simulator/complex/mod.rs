//! The complex step as a scalar: an imaginary part of 1e-30 comes out as the derivative, exact to
//! rounding and by another road than dual numbers.

use sinew_sim::{Scalar, Simulated};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

#[derive(Clone, Copy, Debug)]
pub struct Complex {
    pub re: f64,
    pub im: f64,
}

fn complex(re: f64, im: f64) -> Complex {
    Complex { re, im }
}

impl Simulated for Complex {}

impl Scalar for Complex {
    const ZERO: Self = Complex { re: 0.0, im: 0.0 };

    fn constant(value: f64) -> Self {
        complex(value, 0.0)
    }

    fn value(self) -> f64 {
        self.re
    }

    fn sin(self) -> Self {
        complex(
            self.re.sin() * self.im.cosh(),
            self.re.cos() * self.im.sinh(),
        )
    }

    fn cos(self) -> Self {
        complex(
            self.re.cos() * self.im.cosh(),
            -self.re.sin() * self.im.sinh(),
        )
    }

    fn exp(self) -> Self {
        let size = self.re.exp();
        complex(size * self.im.cos(), size * self.im.sin())
    }

    fn ln(self) -> Self {
        complex(self.re.hypot(self.im).ln(), self.im.atan2(self.re))
    }

    fn tanh(self) -> Self {
        let double = (self + self).exp();
        (double - 1.0) / (double + 1.0)
    }

    fn sqrt(self) -> Self {
        (self.ln() * 0.5).exp()
    }
}

impl Neg for Complex {
    type Output = Self;
    fn neg(self) -> Self {
        complex(-self.re, -self.im)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        complex(self.re + o.re, self.im + o.im)
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        complex(self.re - o.re, self.im - o.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        complex(
            self.re * o.re - self.im * o.im,
            self.re * o.im + self.im * o.re,
        )
    }
}

impl Div for Complex {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let size = o.re * o.re + o.im * o.im;
        self * complex(o.re / size, -o.im / size)
    }
}

macro_rules! with_numbers {
    ($($trait:ident::$method:ident),*) => {$(
        impl $trait<f64> for Complex {
            type Output = Self;
            fn $method(self, o: f64) -> Self {
                $trait::$method(self, complex(o, 0.0))
            }
        }
    )*};
}
with_numbers!(Add::add, Sub::sub, Mul::mul, Div::div);

impl AddAssign for Complex {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for Complex {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
