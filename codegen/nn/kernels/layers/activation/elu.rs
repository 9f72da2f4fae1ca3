//! `scale z` where positive, else `scale alpha (exp(z) - 1)`; SELU with its two constants.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// `scale z` where positive, else `scale alpha (exp(z) - 1)`; SELU with its two constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elu {
    /// Minus the limit on the negative side, before the scale.
    pub alpha: f32,
    /// Slope where z is positive.
    pub scale: f32,
}

impl Elementwise for Elu {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        if z.value() > 0.0 {
            return z.weigh(self.scale);
        }
        let saturating = self.scale * self.alpha;
        let e = math::exp(z.value());
        z.apply(saturating * e - saturating, saturating * e)
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, a: N) -> N {
        // The value has the sign of z where alpha and scale are not negative, and may stand in its
        // place.
        if z.value() > 0.0 {
            N::constant(self.scale)
        } else {
            a + N::constant(self.scale * self.alpha)
        }
    }
}
