//! `z Phi(z)`, with Phi the normal distribution, and its usual approximation by tanh.

use crate::layers::elementwise::Elementwise;
use crate::math;
use crate::number::Number;

/// 1 / sqrt(2).
const ROOT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;
/// 1 / sqrt(2 pi).
const DENSITY: f32 = 0.398_942_3;
/// sqrt(2 / pi) and its product with the 0.044715 of Hendrycks and Gimpel (2016).
const LINEAR: f32 = 0.797_884_6;
const CUBIC: f32 = LINEAR * 0.044_715;

/// `z Phi(z)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gelu;

/// The normal distribution at `z`.
#[inline(always)]
fn normal<N: Number>(z: N) -> N {
    let x = z.value();
    z.apply(
        0.5 + 0.5 * math::erf(ROOT_HALF * x),
        DENSITY * math::exp(-0.5 * x * x),
    )
}

/// The normal density at `z`.
#[inline(always)]
fn density<N: Number>(z: N) -> N {
    let x = z.value();
    let y = DENSITY * math::exp(-0.5 * x * x);
    z.apply(y, -x * y)
}

impl Elementwise for Gelu {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        z * normal(z)
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, _a: N) -> N {
        normal(z) + z * density(z)
    }
}

/// `z / 2 (1 + tanh(sqrt(2 / pi) (z + 0.044715 z^3)))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeluTanh;

/// The tanh in [`GeluTanh`].
#[inline(always)]
fn bend<N: Number>(z: N) -> N {
    let inner = z.weigh(LINEAR) + (z * z * z).weigh(CUBIC);
    let y = math::tanh(inner.value());
    inner.apply(y, 1.0 - y * y)
}

impl Elementwise for GeluTanh {
    #[inline(always)]
    fn value<N: Number>(self, z: N) -> N {
        z.weigh(0.5) * (N::constant(1.0) + bend(z))
    }

    #[inline(always)]
    fn slope<N: Number>(self, z: N, _a: N) -> N {
        let t = bend(z);
        let inner = N::constant(LINEAR) + (z * z).weigh(3.0 * CUBIC);
        (N::constant(1.0) + t).weigh(0.5) + z.weigh(0.5) * (N::constant(1.0) - t * t) * inner
    }
}
