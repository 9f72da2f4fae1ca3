//! Rectifier `max(0, z)`; NaN stays NaN.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// Rectifier `max(0, z)`; NaN stays NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relu;

impl Elementwise for Relu {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        if z.value() <= 0.0 { N::ZERO } else { z }
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        N::constant(if a.value() > 0.0 { 1.0 } else { 0.0 })
    }

    /// By a product: a choice takes two instructions for each of `t`, and one to begin with.
    #[inline(always)]
    fn back<N: Number, const R: usize>(self, _z: N, a: N, t: [N; R]) -> [N; R] {
        let slope = if a.value() > 0.0 { 1.0 } else { 0.0 };
        t.map(|t| t.weigh(slope))
    }
}
