//! Normalisation of each run of the last axis by its own mean and variance.

use crate::math;
use crate::number::Number;

/// The mean of a run, and `1 / sqrt(variance + epsilon)`.
#[inline(always)]
fn moments<N: Number, const LAST: usize>(epsilon: f32, x: &[N]) -> (N, N) {
    let share = 1.0 / LAST as f32;
    let mean = x.iter().fold(N::ZERO, |sum, x| sum + *x).weigh(share);
    let square = |x: &N| (*x - mean) * (*x - mean);
    let variance = x
        .iter()
        .fold(N::ZERO, |sum, x| sum + square(x))
        .weigh(share);
    let shifted = variance + N::constant(epsilon);
    let r = math::reciprocal_root(shifted.value());
    (mean, shifted.apply(r, -0.5 * r * r * r))
}

/// `y = (x - mean) / sqrt(variance + epsilon)` over each run of `LAST` elements.
#[inline(always)]
pub fn normalise<N: Number, const LEN: usize, const LAST: usize>(
    epsilon: f32,
    x: &[N; LEN],
    y: &mut [N; LEN],
) {
    for (y, x) in y.chunks_exact_mut(LAST).zip(x.chunks_exact(LAST)) {
        let (mean, r) = moments::<N, LAST>(epsilon, x);
        for (y, x) in y.iter_mut().zip(x) {
            *y = (*x - mean) * r;
        }
    }
}

/// Adjoints of `y` to adjoints of `x`, in place, with `r = 1 / sqrt(variance + epsilon)`:
/// `t = r (t - mean(t) - y mean(y t))`.
#[inline(always)]
pub fn normalise_back<N: Number, const LEN: usize, const LAST: usize, const R: usize>(
    epsilon: f32,
    x: &[N; LEN],
    y: &[N; LEN],
    t: &mut [[N; R]; LEN],
) {
    let share = 1.0 / LAST as f32;
    let runs = x.chunks_exact(LAST).zip(y.chunks_exact(LAST));
    for ((x, y), t) in runs.zip(t.chunks_exact_mut(LAST)) {
        let (_, r) = moments::<N, LAST>(epsilon, x);
        let (mut plain, mut along) = ([N::ZERO; R], [N::ZERO; R]);
        for (y, t) in y.iter().zip(t.iter()) {
            for ((plain, along), t) in plain.iter_mut().zip(along.iter_mut()).zip(t) {
                *plain = *plain + *t;
                *along = *along + *y * *t;
            }
        }
        for (y, t) in y.iter().zip(t) {
            for ((t, plain), along) in t.iter_mut().zip(&plain).zip(&along) {
                *t = r * (*t - plain.weigh(share) - *y * along.weigh(share));
            }
        }
    }
}
