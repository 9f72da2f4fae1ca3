//! `alpha z + beta`, held between 0 and 1.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// `alpha z + beta`, held between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardSigmoid {
    /// Slope.
    pub alpha: f32,
    /// Value at 0.
    pub beta: f32,
}

impl Elementwise for HardSigmoid {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let y = z.weigh(self.alpha) + N::constant(self.beta);
        if y.value() <= 0.0 {
            N::ZERO
        } else if y.value() >= 1.0 {
            N::constant(1.0)
        } else {
            y
        }
    }

    #[inline(always)]
    fn slope<N: Number>(self, _z: N, a: N) -> N {
        let inside = a.value() > 0.0 && a.value() < 1.0;
        N::constant(if inside { self.alpha } else { 0.0 })
    }
}
