//! `ln z`.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// `ln z`; NaN where z is negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Logarithm;

impl Elementwise for Logarithm {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        z.apply(math::ln(z.value()), 1.0 / z.value())
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, _a: N) -> N {
        let y = 1.0 / z.value();
        z.apply(y, -y * y)
    }
}
