//! `1 / z`.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// `1 / z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reciprocal;

impl Elementwise for Reciprocal {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let y = 1.0 / z.value();
        z.apply(y, -y * y)
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        -(a * a)
    }
}
