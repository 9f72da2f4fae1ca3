//! The only home of transcendental functions. Every function uses `+ - * /`, comparisons and
//! nothing else, each rounded to nearest once, so host and Cortex-M4F give the same bits; the
//! compiler never fuses `a * b + c`, and neither do we.

mod activation;

pub use activation::{clamp, relu, relu_slope, sigmoid, sigmoid_slope, tanh, tanh_slope};

/// Second derivative of [`tanh`] from its value: `-2 y (1 - y^2)`.
#[inline(always)]
pub fn tanh_bend(y: f32) -> f32 {
    -2.0 * y * (1.0 - y * y)
}

/// Largest f32 that is not above `a + b` in real arithmetic.
///
/// Two-sum gives the rounding error of the sum exactly; where the sum was rounded up, the next
/// number down is the answer. A sum that overflows to infinity becomes the largest finite number;
/// an infinite operand is kept, NaN gives NaN.
#[inline]
pub fn add_down(a: f32, b: f32) -> f32 {
    let sum = a + b;
    if !sum.is_finite() {
        let overflowed = a.is_finite() && b.is_finite() && sum > 0.0;
        return if overflowed { f32::MAX } else { sum };
    }
    if two_sum_error(a, b, sum) < 0.0 {
        next_down(sum)
    } else {
        sum
    }
}

/// Largest f32 below a finite `x` (`f32::next_down` of Rust 1.86).
#[inline]
fn next_down(x: f32) -> f32 {
    let bits = x.to_bits();
    f32::from_bits(if x == 0.0 {
        // Both zeros: the smallest negative number.
        0x8000_0001
    } else if x.is_sign_positive() {
        bits - 1
    } else {
        bits + 1
    })
}

/// Smallest f32 that is not below `a + b` in real arithmetic; see [`add_down`].
#[inline]
pub fn add_up(a: f32, b: f32) -> f32 {
    -add_down(-a, -b)
}

/// `(a + b) - sum` exactly, where `sum` is `a + b` rounded to nearest (Knuth's two-sum; any order
/// of magnitudes, no overflow as long as `sum` is finite, exact with subnormals too).
#[inline]
fn two_sum_error(a: f32, b: f32, sum: f32) -> f32 {
    let b_part = sum - a;
    let a_part = sum - b_part;
    (a - a_part) + (b - b_part)
}
