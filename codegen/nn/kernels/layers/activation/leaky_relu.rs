//! Leaky rectifier: `z` where positive, else `alpha z`.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// Leaky rectifier: `z` where positive, else `alpha z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeakyRelu {
    /// Slope where z is negative.
    pub alpha: f32,
}

impl Elementwise for LeakyRelu {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        if z.value() < 0.0 {
            z.weigh(self.alpha)
        } else {
            z
        }
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, _a: N) -> N {
        // The value has the sign of z where alpha is not negative, and may stand in its place.
        N::constant(if z.value() > 0.0 { 1.0 } else { self.alpha })
    }
}
