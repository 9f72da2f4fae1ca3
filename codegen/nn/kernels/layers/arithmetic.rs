//! Scaling, addition, concatenation and the order of axes.

use crate::number::Number;

/// `y = gain x + offset`, channel by channel: the last axis has `C` of them.
#[inline(always)]
pub fn scale<N: Number, const LEN: usize, const C: usize>(
    gain: &[f32; C],
    offset: &[f32; C],
    x: &[N; LEN],
    y: &mut [N; LEN],
) {
    for (y, x) in y.chunks_exact_mut(C).zip(x.chunks_exact(C)) {
        for ((y, x), (gain, offset)) in y.iter_mut().zip(x).zip(gain.iter().zip(offset)) {
            *y = x.weigh(*gain) + N::constant(*offset);
        }
    }
}

/// `gain t`, element by element.
#[inline(always)]
pub fn weighed<const LEN: usize>(gain: &[f32; LEN], mut t: [f32; LEN]) -> [f32; LEN] {
    for (t, gain) in t.iter_mut().zip(gain) {
        *t *= gain;
    }
    t
}

/// Adjoints of `y` to adjoints of `x`: `t_x = gain t_y`.
#[inline(always)]
pub fn scale_back<N: Number, const LEN: usize, const C: usize, const R: usize>(
    gain: &[f32; C],
    t_y: &[[N; R]; LEN],
    t_x: &mut [[N; R]; LEN],
) {
    for (t_x, t_y) in t_x.chunks_exact_mut(C).zip(t_y.chunks_exact(C)) {
        for ((t_x, t_y), gain) in t_x.iter_mut().zip(t_y).zip(gain) {
            for (t_x, t_y) in t_x.iter_mut().zip(t_y) {
                *t_x = t_y.weigh(*gain);
            }
        }
    }
}

/// `y += x`.
#[inline(always)]
pub fn add<N: Number, const LEN: usize>(x: &[N; LEN], y: &mut [N; LEN]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = *y + *x;
    }
}

/// `y *= x`.
#[inline(always)]
pub fn multiply<N: Number, const LEN: usize>(x: &[N; LEN], y: &mut [N; LEN]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = *y * *x;
    }
}

/// Adjoints of a product to those of one factor, `other` being the second: `t_x = other t_y`.
#[inline(always)]
pub fn multiply_back<N: Number, const LEN: usize, const R: usize>(
    other: &[N; LEN],
    t_y: &[[N; R]; LEN],
    t_x: &mut [[N; R]; LEN],
) {
    for ((t_x, t_y), other) in t_x.iter_mut().zip(t_y).zip(other) {
        for (t_x, t_y) in t_x.iter_mut().zip(t_y) {
            *t_x = *other * *t_y;
        }
    }
}

/// Adjoints that reach a value by one more way: `t += more`.
#[inline(always)]
pub fn add_back<N: Number, const LEN: usize, const R: usize>(
    more: &[[N; R]; LEN],
    t: &mut [[N; R]; LEN],
) {
    for (t, more) in t.iter_mut().zip(more) {
        add(more, t);
    }
}

/// One part of a concatenation: of each run of `TOTAL` elements of `y`, the `PART` from `start` on
/// are those of `x`.
#[inline(always)]
pub fn concatenate<
    T: Copy,
    const LEN: usize,
    const OUT: usize,
    const PART: usize,
    const TOTAL: usize,
>(
    start: usize,
    x: &[T; LEN],
    y: &mut [T; OUT],
) {
    for (y, x) in y.chunks_exact_mut(TOTAL).zip(x.chunks_exact(PART)) {
        for (y, x) in y.iter_mut().skip(start).zip(x) {
            *y = *x;
        }
    }
}

/// The inverse of [`concatenate`]: the adjoints of one part.
#[inline(always)]
pub fn concatenate_back<
    T: Copy,
    const LEN: usize,
    const OUT: usize,
    const PART: usize,
    const TOTAL: usize,
>(
    start: usize,
    t_y: &[T; OUT],
    t_x: &mut [T; LEN],
) {
    for (t_y, t_x) in t_y.chunks_exact(TOTAL).zip(t_x.chunks_exact_mut(PART)) {
        for (t_y, t_x) in t_y.iter().skip(start).zip(t_x) {
            *t_x = *t_y;
        }
    }
}

/// Another order of axes: element `(i, j, k)` of `y`, whose shape is `shape`, is the element of `x`
/// at `i steps[0] + j steps[1] + k steps[2]`.
#[inline(always)]
pub fn permute<T: Copy, const LEN: usize>(
    shape: [usize; 3],
    steps: [usize; 3],
    x: &[T; LEN],
    y: &mut [T; LEN],
) {
    let mut y = y.iter_mut();
    for i in 0..shape[0] {
        for j in 0..shape[1] {
            for k in 0..shape[2] {
                let place = i * steps[0] + j * steps[1] + k * steps[2];
                if let (Some(x), Some(y)) = (x.get(place), y.next()) {
                    *y = *x;
                }
            }
        }
    }
}
