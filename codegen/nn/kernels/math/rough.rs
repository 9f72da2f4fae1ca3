//! [`tanh`] and [`sigmoid`] within 9e-4, by a rational function of few terms.

use super::clamp;

/// End of the rational of [`tanh`]; beyond, the value at the end is returned.
const TANH_END: f32 = 4.2;

/// Numerator and denominator of [`tanh`] in x^2, lowest power first: minimax on [0, 4.2], levelled
/// error 3.7e-4 (`firmware/mpc/scripts/tanh_minimax.py 1 2 4.2` prints them).
const TANH_P: [f32; 2] = [0.998_490_65, 8.014_093e-2];
const TANH_Q: [f32; 3] = [1.0, 0.409_690_2, 6.146_089e-3];

/// Hyperbolic tangent, `x P(x^2) / Q(x^2)` with the argument held at 4.2.
///
/// Largest error 9e-4 (absolute, swept in `tests/tolerances.rs`); odd, never beyond 1; NaN gives
/// NaN, infinities give the value at the end.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let x = clamp(x, -TANH_END, TANH_END);
    let z = x * x;
    let p = TANH_P[1] * z + TANH_P[0];
    let q = (TANH_Q[2] * z + TANH_Q[1]) * z + TANH_Q[0];
    x * p / q
}

/// Logistic sigmoid `1 / (1 + exp(-x)) = 1/2 + 1/2 tanh(x / 2)`. Largest error half of that of
/// [`tanh`].
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    0.5 + 0.5 * tanh(0.5 * x)
}
