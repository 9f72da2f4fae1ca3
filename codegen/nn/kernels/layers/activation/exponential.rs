//! `exp(z)`.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// `exp(z)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential;

impl Elementwise for Exponential {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let y = math::exp(z.value());
        z.apply(y, y)
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        a
    }
}
