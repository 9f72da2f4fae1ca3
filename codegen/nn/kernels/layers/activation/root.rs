//! `sqrt(z)`.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// `sqrt(z)`; NaN where z is negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root;

impl Elementwise for Root {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let y = math::root(z.value());
        z.apply(y, 0.5 / y)
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        let half = 0.5 / a.value();
        a.apply(half, -half / a.value())
    }
}
