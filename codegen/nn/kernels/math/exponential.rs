//! Exponential, logarithm and error function. Coefficients: scripts/minimax.py.

use super::clamp;

/// `e^r = 1 + r P(r)` within half of ln 2: relative error 9e-8.
const EXP: [f32; 5] = [
    0.999_999_7,
    0.499_991_5,
    0.166_676_36,
    4.189_793e-2,
    8.290_31e-3,
];

/// ln 2 in two parts, the first with so few bits that its multiples are exact.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// Exponential function. Relative error 3e-7; NaN gives NaN, beyond 88.7 infinity, below -87.3
/// zero.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let held = clamp(x, -88.0, 89.0);
    let scaled = held * core::f32::consts::LOG2_E;
    // Rounds to the nearest integer: `as` cuts towards zero, and takes NaN to 0.
    let k = (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i32;
    let r = (held - k as f32 * LN_2[0]) - k as f32 * LN_2[1];
    let p = (((EXP[4] * r + EXP[3]) * r + EXP[2]) * r + EXP[1]) * r + EXP[0];
    // Two factors, since 2^128 is none: k is between -127 and 128.
    let half = k >> 1;
    (1.0 + r * p) * power_of_two(half) * power_of_two(k - half)
}

/// `2^k` for k from -126 to 127.
#[inline(always)]
fn power_of_two(k: i32) -> f32 {
    f32::from_bits(((k + 127) as u32) << 23)
}

/// `ln(1 + x) = x P(x) / Q(x)` on [0, 1]: relative error 2e-9.
const LN_1P_P: [f32; 4] = [1.0, 1.065_399_2, 0.237_686_55, 3.403_152_8e-3];
const LN_1P_Q: [f32; 4] = [1.0, 1.565_399, 0.687_055_8, 7.510_523e-2];

/// `ln(1 + x)` for x from 0 to 1. Relative error 3e-7; NaN gives NaN.
#[inline(always)]
pub fn ln_1p(x: f32) -> f32 {
    let p = ((LN_1P_P[3] * x + LN_1P_P[2]) * x + LN_1P_P[1]) * x + LN_1P_P[0];
    let q = ((LN_1P_Q[3] * x + LN_1P_Q[2]) * x + LN_1P_Q[1]) * x + LN_1P_Q[0];
    x * p / q
}

/// Natural logarithm. Error 3e-7 of 1 + |ln x|; 0 gives minus infinity, a negative number or NaN
/// gives NaN. Below the smallest normal number x counts as 0.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    if x < f32::MIN_POSITIVE {
        return if x < 0.0 { f32::NAN } else { f32::NEG_INFINITY };
    }
    if x.is_nan() || x == f32::INFINITY {
        return x;
    }
    let bits = x.to_bits();
    let k = (bits >> 23) as i32 - 127;
    // Between 1 and 2.
    let m = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000);
    k as f32 * core::f32::consts::LN_2 + ln_1p(m - 1.0)
}

/// `erf x = x P(x^2) / Q(x^2)` on [-4, 4]: minimax, error 2e-8.
const ERF_P: [f32; 6] = [
    core::f32::consts::FRAC_2_SQRT_PI,
    0.196_242_05,
    5.346_652e-2,
    4.003_335_9e-3,
    2.880_323e-4,
    1.974_855_8e-6,
];
const ERF_Q: [f32; 6] = [
    1.0,
    0.507_246_15,
    0.116_473_52,
    1.544_380_5e-2,
    1.216_280_6e-3,
    3.748_065e-5,
];

/// Error function. Largest error 4e-7 (absolute); beyond 4 it is 1 to f32; NaN gives NaN.
#[inline(always)]
pub fn erf(x: f32) -> f32 {
    let x = clamp(x, -4.0, 4.0);
    let z = x * x;
    let p =
        ((((ERF_P[5] * z + ERF_P[4]) * z + ERF_P[3]) * z + ERF_P[2]) * z + ERF_P[1]) * z + ERF_P[0];
    let q =
        ((((ERF_Q[5] * z + ERF_Q[4]) * z + ERF_Q[3]) * z + ERF_Q[2]) * z + ERF_Q[1]) * z + ERF_Q[0];
    x * p / q
}
