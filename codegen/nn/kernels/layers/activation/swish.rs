//! `z sigmoid(z)`, also called SiLU.

use crate::layers::activation::Sigmoid;
use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// `z sigmoid(z)`, also called SiLU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swish;

impl Elementwise for Swish {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        z * Sigmoid.value(z)
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, _a: N) -> N {
        let s = Sigmoid.value(z);
        s + z * s * (N::constant(1.0) - s)
    }
}
