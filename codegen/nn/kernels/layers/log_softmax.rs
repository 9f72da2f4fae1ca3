//! Logarithm of softmax over the last axis.

use crate::math;
use crate::number::Number;

/// `a_i = z_i - m - ln sum exp(z_j - m)` with `m` the largest, in place, over each run of `LAST`
/// elements. Far below the largest it is a difference, where the logarithm of a softmax would be
/// minus infinity.
#[inline(always)]
pub fn log_softmax<N: Number, const LEN: usize, const LAST: usize>(a: &mut [N; LEN]) {
    for a in a.chunks_exact_mut(LAST) {
        let mut largest = f32::NEG_INFINITY;
        for z in a.iter() {
            if z.value() > largest {
                largest = z.value();
            }
        }
        let mut sum = N::ZERO;
        for z in a.iter_mut() {
            *z = *z - N::constant(largest);
            let e = math::exp(z.value());
            sum = sum + z.apply(e, e);
        }
        let shift = sum.apply(math::ln(sum.value()), 1.0 / sum.value());
        for z in a {
            *z = *z - shift;
        }
    }
}

/// Adjoints of `a` to adjoints of `z`, in place: `t_i = t_i - exp(a_i) sum t_j`.
#[inline(always)]
pub fn log_softmax_back<N: Number, const LEN: usize, const LAST: usize, const R: usize>(
    a: &[N; LEN],
    t: &mut [[N; R]; LEN],
) {
    for (a, t) in a.chunks_exact(LAST).zip(t.chunks_exact_mut(LAST)) {
        let mut sum = [N::ZERO; R];
        for t in t.iter() {
            for (sum, t) in sum.iter_mut().zip(t) {
                *sum = *sum + *t;
            }
        }
        for (a, t) in a.iter().zip(t) {
            let e = math::exp(a.value());
            let share = a.apply(e, e);
            for (t, sum) in t.iter_mut().zip(&sum) {
                *t = *t - share * *sum;
            }
        }
    }
}
