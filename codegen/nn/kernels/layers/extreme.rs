//! The larger or the smaller of two values, element by element.

use crate::number::Number;

/// True if the second of two numbers is taken; a NaN is, and where they are equal the first.
#[inline(always)]
fn second<const LARGEST: bool>(a: f32, b: f32) -> bool {
    let beyond = if LARGEST { b > a } else { b < a };
    beyond || b.is_nan()
}

/// `y = max(y, x)`, or the smaller where not `LARGEST`: the bits of one of the two, or NaN where
/// either is.
#[inline(always)]
pub fn extreme<N: Number, const LEN: usize, const LARGEST: bool>(x: &[N; LEN], y: &mut [N; LEN]) {
    for (y, x) in y.iter_mut().zip(x) {
        if second::<LARGEST>(y.value(), x.value()) {
            *y = *x;
        }
    }
}

/// Adjoints of an extreme of `a` and `b` to those of `a` where `FIRST`, else of `b`: `t_y` where
/// that one was taken, zero elsewhere.
#[inline(always)]
pub fn extreme_back<
    N: Number,
    const LEN: usize,
    const R: usize,
    const LARGEST: bool,
    const FIRST: bool,
>(
    a: &[N; LEN],
    b: &[N; LEN],
    t_y: &[[N; R]; LEN],
    t_x: &mut [[N; R]; LEN],
) {
    for ((t_x, t_y), (a, b)) in t_x.iter_mut().zip(t_y).zip(a.iter().zip(b)) {
        let taken = second::<LARGEST>(a.value(), b.value()) != FIRST;
        *t_x = if taken { *t_y } else { [N::ZERO; R] };
    }
}
