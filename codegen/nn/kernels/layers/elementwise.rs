//! A function of one number, applied to every element.

use crate::number::Number;

/// A function of one number, `a = g(z)`.
pub trait Elementwise: Copy {
    /// `g(z)`.
    fn value<N: Number>(self, z: N) -> N;

    /// `g'(z)`, from `z` or from `a = g(z)`, whichever is cheaper.
    fn slope<N: Number>(self, z: N, a: N) -> N;

    /// Adjoints of `a` to adjoints of `z`: `g' t`.
    #[inline(always)]
    fn back<N: Number, const R: usize>(self, z: N, a: N, t: [N; R]) -> [N; R] {
        let slope = self.slope(z, a);
        t.map(|t| slope * t)
    }
}

/// `a = g(a)`, in place.
#[inline(always)]
pub fn activate<N: Number, const LEN: usize>(g: impl Elementwise, a: &mut [N; LEN]) {
    for a in a {
        *a = g.value(*a);
    }
}

/// `a = g(z)`, for functions whose slope needs `z`.
#[inline(always)]
pub fn activate_from<N: Number, const LEN: usize>(
    g: impl Elementwise,
    z: &[N; LEN],
    a: &mut [N; LEN],
) {
    for (a, z) in a.iter_mut().zip(z) {
        *a = g.value(*z);
    }
}

/// Adjoints of `a` to adjoints of `z`, in place: `t = g'(z) t`.
#[inline(always)]
pub fn activate_back<N: Number, const LEN: usize, const R: usize>(
    g: impl Elementwise,
    z: &[N; LEN],
    a: &[N; LEN],
    t: &mut [[N; R]; LEN],
) {
    for ((t, z), a) in t.iter_mut().zip(z).zip(a) {
        *t = g.back(*z, *a, *t);
    }
}

/// The slopes of `g` from its values `a`.
#[inline(always)]
pub fn slopes<const LEN: usize>(g: impl Elementwise, a: &[f32; LEN]) -> [f32; LEN] {
    a.map(|a| g.slope(a, a))
}
