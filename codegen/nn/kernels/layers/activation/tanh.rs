//! Hyperbolic tangent.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// Hyperbolic tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tanh;

impl Elementwise for Tanh {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let y = math::tanh(z.value());
        z.apply(y, 1.0 - y * y)
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        N::constant(1.0) - a * a
    }
}
