//! [`tanh`] and [`sigmoid`] within 5e-5, by a rational function of few terms.

use super::clamp;

/// End of the rational of [`tanh`]; beyond, the value at the end is returned.
const TANH_END: f32 = 5.0;

/// Numerator and denominator of [`tanh`] in x^2, lowest power first: minimax on [0, 5], levelled
/// error 4.3e-5 (`firmware/mpc/scripts/tanh_minimax.py 2 2 5` prints them).
const TANH_P: [f32; 3] = [0.999_810_14, 0.101_723_16, 6.549_443e-4];
const TANH_Q: [f32; 3] = [1.0, 0.434_504_1, 1.263_918_5e-2];

/// Hyperbolic tangent, `x P(x^2) / Q(x^2)` with the argument held at 5.
///
/// Largest error 5e-5 (absolute, swept in `tests/tolerances.rs`); odd, never beyond 1; NaN gives
/// NaN, infinities give the value at the end.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let x = clamp(x, -TANH_END, TANH_END);
    let z = x * x;
    let p = (TANH_P[2] * z + TANH_P[1]) * z + TANH_P[0];
    let q = (TANH_Q[2] * z + TANH_Q[1]) * z + TANH_Q[0];
    x * p / q
}

/// Logistic sigmoid `1 / (1 + exp(-x)) = 1/2 + 1/2 tanh(x / 2)`. Largest error half of that of
/// [`tanh`].
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    0.5 + 0.5 * tanh(0.5 * x)
}
