//! Values at given places: slices, reversals, repetitions, padding with zeros.

use crate::number::Number;

/// `y_i = x_p` with `p = places_i`, and zero where `x` has no such place. Cost: a load and a store
/// for each of `OUT`.
#[inline(always)]
pub fn select<N: Number, const LEN: usize, const OUT: usize>(
    places: &[u16; OUT],
    x: &[N; LEN],
    y: &mut [N; OUT],
) {
    for (y, place) in y.iter_mut().zip(places) {
        *y = x.get(usize::from(*place)).copied().unwrap_or(N::ZERO);
    }
}

/// Adjoints of `y` to adjoints of `x`: those of one place are summed.
#[inline(always)]
pub fn select_back<N: Number, const LEN: usize, const OUT: usize, const R: usize>(
    places: &[u16; OUT],
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; LEN],
) {
    *t_x = [[N::ZERO; R]; LEN];
    for (place, t_y) in places.iter().zip(t_y) {
        if let Some(t_x) = t_x.get_mut(usize::from(*place)) {
            for (t_x, t_y) in t_x.iter_mut().zip(t_y) {
                *t_x = *t_x + *t_y;
            }
        }
    }
}
