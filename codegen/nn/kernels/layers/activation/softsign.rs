//! `z / (1 + |z|)`.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// `z / (1 + |z|)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softsign;

impl Elementwise for Softsign {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let x = z.value();
        let s = 1.0 / (1.0 + if x < 0.0 { -x } else { x });
        z.apply(x * s, s * s)
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        let rest = if a.value() < 0.0 {
            N::constant(1.0) + a
        } else {
            N::constant(1.0) - a
        };
        rest * rest
    }
}
