//! Value held between two bounds.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// `min(max(z, low), high)`; NaN stays NaN. Bounds may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// Smallest value.
    pub low: f32,
    /// Largest value.
    pub high: f32,
}

impl Elementwise for Clip {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        if z.value() >= self.high {
            N::constant(self.high)
        } else if z.value() <= self.low {
            N::constant(self.low)
        } else {
            z
        }
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        let inside = a.value() > self.low && a.value() < self.high;
        N::constant(if inside { 1.0 } else { 0.0 })
    }
}
