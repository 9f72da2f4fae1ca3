//! `ln(1 + exp(z))`.

use crate::layers::activation::Sigmoid;
use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// `ln(1 + exp(z))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softplus;

impl Elementwise for Softplus {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        let x = z.value();
        let (positive, size) = if x > 0.0 { (x, x) } else { (0.0, -x) };
        let e = math::exp(-size);
        let slope = if x > 0.0 { 1.0 } else { e } / (1.0 + e);
        z.apply(positive + math::ln_1p(e), slope)
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, _a: N) -> N {
        Sigmoid.value(z)
    }
}
