//! Activations and their slopes: polynomials and one division. Emitted networks carry a copy of
//! this file.

/// End of the rational of [`tanh`]; beyond, the value at the end is returned.
const TANH_END: f32 = 7.0;

/// Numerator and denominator of [`tanh`] in x^2, lowest power first: minimax on [0, 7], levelled
/// error 9.0e-7 (`firmware/mpc/scripts/tanh_minimax.py` prints them).
const TANH_P: [f32; 4] = [0.999_995_7, 0.123_021_84, 2.276_99e-3, 3.930_018_4e-6];
const TANH_Q: [f32; 4] = [1.0, 0.456_340_3, 2.107_218_5e-2, 1.423_509_7e-4];

/// Hyperbolic sensitivities, `x P(x^2) / Q(x^2)` with the argument held at 7.
///
/// Largest error 2e-6 (absolute, swept in `tests/math.rs`); odd; NaN gives NaN, infinities give the
/// value at the end. Cost: 8 multiplications, 6 additions, 1 division.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let x = clamp(x, -TANH_END, TANH_END);
    let z = x * x;
    let p = ((TANH_P[3] * z + TANH_P[2]) * z + TANH_P[1]) * z + TANH_P[0];
    let q = ((TANH_Q[3] * z + TANH_Q[2]) * z + TANH_Q[1]) * z + TANH_Q[0];
    x * p / q
}

/// Derivative of [`tanh`] from its value: `1 - y^2`.
#[inline(always)]
pub fn tanh_slope(y: f32) -> f32 {
    1.0 - y * y
}

/// Logistic sigmoid `1 / (1 + exp(-x)) = 1/2 + 1/2 tanh(x / 2)`. Largest error 1e-6 (absolute).
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    0.5 + 0.5 * tanh(0.5 * x)
}

/// Derivative of [`sigmoid`] from its value: `y (1 - y)`.
#[inline(always)]
pub fn sigmoid_slope(y: f32) -> f32 {
    y * (1.0 - y)
}

/// Rectifier. NaN gives NaN, -0 gives 0.
#[inline(always)]
pub fn relu(x: f32) -> f32 {
    // `f32::max` would swallow a NaN and leaves the sign of zero to the platform.
    if x <= 0.0 { 0.0 } else { x }
}

/// Derivative of [`relu`] from its value: 1 where positive, else 0.
#[inline(always)]
pub fn relu_slope(y: f32) -> f32 {
    if y > 0.0 { 1.0 } else { 0.0 }
}

/// `x` held within `[lower, upper]`, by comparisons alone: NaN passes, and of two zeros the sign is
/// that of `x`. Unlike [`f32::clamp`] it has no panic; where `lower > upper`, `lower` wins.
#[inline(always)]
pub fn clamp(x: f32, lower: f32, upper: f32) -> f32 {
    let x = if x > upper { upper } else { x };
    if x < lower { lower } else { x }
}
