//! Softmax over the last axis.

use crate::math;
use crate::number::Number;

/// `a_i = exp(z_i) / sum exp(z_j)`, in place, over each run of `LAST` elements. The largest is
/// taken off first, so that nothing overflows.
#[inline(always)]
pub fn softmax<N: Number, const LEN: usize, const LAST: usize>(a: &mut [N; LEN]) {
    for a in a.chunks_exact_mut(LAST) {
        let mut largest = f32::NEG_INFINITY;
        for z in a.iter() {
            if z.value() > largest {
                largest = z.value();
            }
        }
        let mut sum = N::ZERO;
        for z in a.iter_mut() {
            let e = math::exp(z.value() - largest);
            *z = z.apply(e, e);
            sum = sum + *z;
        }
        let share = 1.0 / sum.value();
        let share = sum.apply(share, -share * share);
        for z in a {
            *z = *z * share;
        }
    }
}

/// Adjoints of `a` to adjoints of `z`, in place: `t_i = a_i (t_i - sum a_j t_j)`.
#[inline(always)]
pub fn softmax_back<N: Number, const LEN: usize, const LAST: usize, const R: usize>(
    a: &[N; LEN],
    t: &mut [[N; R]; LEN],
) {
    for (a, t) in a.chunks_exact(LAST).zip(t.chunks_exact_mut(LAST)) {
        let mut mean = [N::ZERO; R];
        for (a, t) in a.iter().zip(t.iter()) {
            for (mean, t) in mean.iter_mut().zip(t) {
                *mean = *mean + *a * *t;
            }
        }
        for (a, t) in a.iter().zip(t) {
            for (t, mean) in t.iter_mut().zip(&mean) {
                *t = *a * (*t - *mean);
            }
        }
    }
}
