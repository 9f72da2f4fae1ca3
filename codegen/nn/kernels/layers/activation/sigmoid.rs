//! Logistic sigmoid `1 / (1 + exp(-z))`.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// Logistic sigmoid `1 / (1 + exp(-z))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigmoid;

impl Elementwise for Sigmoid {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let y = math::sigmoid(z.value());
        z.apply(y, y * (1.0 - y))
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        a * (N::constant(1.0) - a)
    }
}
