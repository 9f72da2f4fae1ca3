//! No activation: `z`.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// No activation: `z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear;

impl Elementwise for Linear {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        z
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, _a: N) -> N {
        N::constant(1.0)
    }
}
