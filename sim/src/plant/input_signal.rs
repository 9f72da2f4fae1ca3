//! Inputs of the actuators as functions of time, piece by piece (docs/explanation/plant.md, eq.
//! 14).

use crate::scalar::Scalar;

/// Form of an input signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Constant.
    Held,
    /// A straight line.
    Ramp,
    /// A parabola.
    Parabola,
    /// A parabola and a decaying exponential: what a lag makes of it.
    Lagged,
}

/// One line's input before its gain: `c_0 + c_1 s + c_2 s^2 + decay exp(-rate s)`, with `s` seconds
/// after `origin`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InputSignal<S> {
    pub(crate) shape: Shape,
    pub(crate) c: [S; 3],
    pub(crate) decay: S,
    pub(crate) rate: S,
    pub(crate) origin: S,
}

impl<S: Scalar> InputSignal<S> {
    pub(crate) const ZERO: Self = Self {
        shape: Shape::Held,
        c: [S::ZERO; 3],
        decay: S::ZERO,
        rate: S::ZERO,
        origin: S::ZERO,
    };

    /// The input, `tau` seconds into the sample interval.
    #[inline]
    pub(crate) fn at(&self, tau: S) -> S {
        match self.shape {
            Shape::Held => self.c[0],
            Shape::Ramp => self.c[0] + self.c[1] * (tau - self.origin),
            Shape::Parabola => self.parabola(tau - self.origin),
            Shape::Lagged => {
                let s = tau - self.origin;
                self.parabola(s) + self.decay * (-(self.rate * s)).exp()
            }
        }
    }

    fn parabola(&self, s: S) -> S {
        self.c[0] + s * (self.c[1] + s * self.c[2])
    }

    /// The same without derivatives.
    pub(crate) fn plain(&self) -> InputSignal<f64> {
        InputSignal {
            shape: self.shape,
            c: self.c.map(S::value),
            decay: self.decay.value(),
            rate: self.rate.value(),
            origin: self.origin.value(),
        }
    }
}
