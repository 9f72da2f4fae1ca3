//! A dense layer: every output is a weighted sum of all inputs.

use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// `y = W x + b`. Shapes: `w` is `[OUT][IN]`. Cost: `IN OUT` multiply-adds.
#[inline(always)]
pub fn dense<N: Number, const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    b: &[f32; OUT],
    x: &[N; IN],
    y: &mut [N; OUT],
) {
    for ((row, b), y) in w.iter().zip(b).zip(y) {
        *y = weighted_sum(N::constant(*b), row, x);
    }
}

/// `start + w . x`.
#[inline(always)]
pub(crate) fn weighted_sum<N: Number>(start: N, w: &[f32], x: &[N]) -> N {
    let mut sum = start;
    for (w, x) in w.iter().zip(x) {
        sum = sum + x.weigh(*w);
    }
    sum
}

/// Adjoints of `y` to adjoints of `x`: `t_x = W' t_y`, for `R` results at once. Cost: `IN OUT R`
/// multiply-adds.
#[inline(always)]
pub fn dense_back<N: Number, const IN: usize, const OUT: usize, const R: usize>(
    w: &[[f32; IN]; OUT],
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; IN],
) {
    *t_x = [[N::ZERO; R]; IN];
    add_dense_back(w, t_y, t_x);
}

/// As [`dense_back`], added to what `t_x` holds.
///
/// Four inputs at a time: their sums stay in registers while the outputs pass.
#[inline(always)]
pub fn add_dense_back<N: Number, const IN: usize, const OUT: usize, const R: usize>(
    w: &[[f32; IN]; OUT],
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; IN],
) {
    let (fours, rest) = t_x.as_chunks_mut::<4>();
    let done = 4 * fours.len();
    for (i, t_x) in fours.iter_mut().enumerate() {
        columns(w, t_y, 4 * i, t_x);
    }
    for (i, t_x) in rest.iter_mut().enumerate() {
        columns(w, t_y, done + i, core::array::from_mut(t_x));
    }
}

/// `t_x[c] += sum over rows of w[row][start + c] t_y[row]`.
#[inline(always)]
fn columns<N: Number, const IN: usize, const OUT: usize, const R: usize, const B: usize>(
    w: &[[f32; IN]; OUT],
    t_y: &[[N; R]; OUT],
    start: usize,
    t_x: &mut [[N; R]; B],
) {
    let mut sum = *t_x;
    for (row, t) in w.iter().zip(t_y) {
        if let Some((row, _)) = row.get(start..).and_then(<[f32]>::split_first_chunk::<B>) {
            for (sum, w) in sum.iter_mut().zip(row) {
                for (sum, t) in sum.iter_mut().zip(t) {
                    *sum = *sum + t.weigh(*w);
                }
            }
        }
    }
    *t_x = sum;
}

/// Adjoints of the inputs of a last layer, one result for each output: `t_x = W'`.
#[inline(always)]
pub fn dense_seed<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    t_x: &mut [[f32; OUT]; IN],
) {
    for (r, row) in w.iter().enumerate() {
        for (t, w) in t_x.iter_mut().zip(row) {
            t[r] = *w;
        }
    }
}

/// As [`dense_seed`], with activation `g` after the layer: `t_x = W' diag(g')`.
#[inline(always)]
pub fn dense_seed_activated<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    g: impl Elementwise,
    y: &[f32; OUT],
    t_x: &mut [[f32; OUT]; IN],
) {
    for (r, (row, y)) in w.iter().zip(y).enumerate() {
        let slope = g.slope(*y, *y);
        for (t, w) in t_x.iter_mut().zip(row) {
            t[r] = slope * w;
        }
    }
}
