//! A dense layer: every output is a weighted sum of all inputs.

use crate::layers::elementwise::Elementwise;
use crate::layers::rows::{Rows, Weight};
use crate::number::Number;

/// `y = W x + b`. Shapes: `w` is `[OUT][IN]`. Cost: `IN OUT` multiply-adds.
#[inline(always)]
pub fn dense<N: Number, W: Weight, const IN: usize, const OUT: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    b: &[f32; OUT],
    x: &[N; IN],
    y: &mut [N; OUT],
) {
    for (r, ((row, b), y)) in w.rows().iter().zip(b).zip(y).enumerate() {
        *y = w.end(
            r,
            weighted_sum(w.start(N::constant(*b)), row, x),
            N::constant(*b),
        );
    }
}

/// `start + w . x`.
#[inline(always)]
pub(crate) fn weighted_sum<N: Number, W: Weight>(start: N, w: &[W], x: &[N]) -> N {
    let mut sum = start;
    for (w, x) in w.iter().zip(x) {
        sum = sum + x.weigh(w.value());
    }
    sum
}

/// Bytes of the registers that sums and adjoints may fill: of 32, some are left for weights.
const REGISTERS: usize = 24 * 4;

/// Adjoints of `y` to adjoints of `x`: `t_x = W' t_y`, for `R` results at once. Cost: `IN OUT R`
/// multiply-adds.
#[inline(always)]
pub fn dense_back<N: Number, W: Weight, const IN: usize, const OUT: usize, const R: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; IN],
) {
    back_through(w, t_y, |_, t| t, t_x);
}

/// As [`dense_back`], and on through activation `g` of the layer before, whose values are `a`:
/// `t_x = diag(g') W' t_y`. The slopes meet the sums while these are in registers.
#[inline(always)]
pub fn dense_back_activated<
    N: Number,
    W: Weight,
    const IN: usize,
    const OUT: usize,
    const R: usize,
>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    g: impl Elementwise,
    a: &[N; IN],
    t_x: &mut [[N; R]; IN],
) {
    let slope = |i: usize, t: [N; R]| a.get(i).map_or(t, |a| g.back(*a, *a, t));
    back_through(w, t_y, slope, t_x);
}

/// `t_x[i] = end(i, sum over rows of w[row][i] t_y[row])`: either all of `t_y` stays in registers,
/// or the sums of as many inputs as there is room for.
#[inline(always)]
fn back_through<N: Number, W: Weight, const IN: usize, const OUT: usize, const R: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    end: impl Fn(usize, [N; R]) -> [N; R],
    t_x: &mut [[N; R]; IN],
) {
    if size_of::<[[N; R]; OUT]>() <= REGISTERS {
        let mut scaled = *t_y;
        for (r, t) in scaled.iter_mut().enumerate() {
            for t in t {
                *t = w.scaled(r, *t);
            }
        }
        // By place, not by an iterator over `t_x`: then no check of `i` against rows is left.
        for i in 0..IN {
            if let Some(t_x) = t_x.get_mut(i) {
                *t_x = end(i, column(w.rows(), &scaled, i));
            }
        }
    } else if size_of::<[[N; R]; 8]>() <= REGISTERS {
        back_by::<8, N, W, IN, OUT, R>(w, t_y, end, t_x);
    } else {
        back_by::<4, N, W, IN, OUT, R>(w, t_y, end, t_x);
    }
}

/// `sum over rows of w[row][i] t[row]`, result by result. The first product begins the sum; nought
/// is not added.
#[inline(always)]
pub(crate) fn column<'a, N: Number, W: Weight + 'a, const IN: usize, const R: usize>(
    rows: impl IntoIterator<Item = &'a [W; IN]> + Copy,
    t: &[[N; R]],
    i: usize,
) -> [N; R] {
    let mut sums = [N::ZERO; R];
    for (q, sum) in sums.iter_mut().enumerate() {
        let mut first = true;
        for (row, t) in rows.into_iter().zip(t) {
            if let (Some(w), Some(t)) = (row.get(i), t.get(q)) {
                let product = t.weigh(w.value());
                *sum = if first { product } else { *sum + product };
            }
            first = false;
        }
    }
    sums
}

/// As [`back_through`], `B` inputs at a time. Not inlined: what is known of `t_y` there would be
/// kept in registers that the sums need.
#[inline(never)]
fn back_by<
    const B: usize,
    N: Number,
    W: Weight,
    const IN: usize,
    const OUT: usize,
    const R: usize,
>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    end: impl Fn(usize, [N; R]) -> [N; R],
    t_x: &mut [[N; R]; IN],
) {
    // The compiler folds these lengths: all are those of types.
    let (blocks, rest) = t_x.split_at_mut(IN - IN % B);
    let done = blocks.len();
    for (block, t_x) in blocks.chunks_exact_mut(B).enumerate() {
        let sums = columns::<N, W, IN, OUT, R, B>(w, t_y, B * block);
        for (c, (t_x, sum)) in t_x.iter_mut().zip(sums).enumerate() {
            *t_x = end(B * block + c, sum);
        }
    }
    let (fours, ones) = rest.split_at_mut(IN % B - IN % B % 4);
    let last = done + fours.len();
    for (block, t_x) in fours.chunks_exact_mut(4).enumerate() {
        let start = done + 4 * block;
        let sums = columns::<N, W, IN, OUT, R, 4>(w, t_y, start);
        for (c, (t_x, sum)) in t_x.iter_mut().zip(sums).enumerate() {
            *t_x = end(start + c, sum);
        }
    }
    for (c, t_x) in ones.iter_mut().enumerate() {
        let [sum] = columns(w, t_y, last + c);
        *t_x = end(last + c, sum);
    }
}

/// For `B` inputs from `start` on: `sum over rows of w[row][start + c] t_y[row]`. The first product
/// begins the sum; nought is not added.
#[inline(always)]
fn columns<
    N: Number,
    W: Weight,
    const IN: usize,
    const OUT: usize,
    const R: usize,
    const B: usize,
>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    start: usize,
) -> [[N; R]; B] {
    let mut sum = [[N::ZERO; R]; B];
    let mut first = true;
    for (r, (row, t)) in w.rows().iter().zip(t_y).enumerate() {
        let t = t.map(|t| w.scaled(r, t));
        if let Some((row, _)) = row.get(start..).and_then(<[W]>::split_first_chunk::<B>) {
            for (sum, w) in sum.iter_mut().zip(row) {
                for (sum, t) in sum.iter_mut().zip(&t) {
                    let product = t.weigh(w.value());
                    *sum = if first { product } else { *sum + product };
                }
            }
        }
        first = false;
    }
    sum
}

/// As [`dense_back`], added to what `t_x` holds.
///
/// Four inputs at a time: their sums stay in registers while the outputs pass.
#[inline(always)]
pub fn add_dense_back<N: Number, W: Weight, const IN: usize, const OUT: usize, const R: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; IN],
) {
    let (fours, rest) = t_x.split_at_mut(IN - IN % 4);
    let done = fours.len();
    for (i, t_x) in fours.chunks_exact_mut(4).enumerate() {
        if let Some(t_x) = t_x.first_chunk_mut::<4>() {
            add_columns(w, t_y, 4 * i, t_x);
        }
    }
    for (i, t_x) in rest.iter_mut().enumerate() {
        add_columns(w, t_y, done + i, core::array::from_mut(t_x));
    }
}

/// `t_x[c] += sum over rows of w[row][start + c] t_y[row]`.
#[inline(always)]
fn add_columns<
    N: Number,
    W: Weight,
    const IN: usize,
    const OUT: usize,
    const R: usize,
    const B: usize,
>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    t_y: &[[N; R]; OUT],
    start: usize,
    t_x: &mut [[N; R]; B],
) {
    let mut sum = *t_x;
    for (r, (row, t)) in w.rows().iter().zip(t_y).enumerate() {
        let t = t.map(|t| w.scaled(r, t));
        if let Some((row, _)) = row.get(start..).and_then(<[W]>::split_first_chunk::<B>) {
            for (sum, w) in sum.iter_mut().zip(row) {
                for (sum, t) in sum.iter_mut().zip(&t) {
                    *sum = *sum + t.weigh(w.value());
                }
            }
        }
    }
    *t_x = sum;
}

/// Adjoints of the inputs of a last layer, one result for each output: `t_x = W' diag(outer)`,
/// where `outer` are the slopes of what follows the layer.
#[inline(always)]
pub fn dense_seed<W: Weight, const IN: usize, const OUT: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    outer: &[f32; OUT],
    t_x: &mut [[f32; OUT]; IN],
) {
    for (r, (row, outer)) in w.rows().iter().zip(outer).enumerate() {
        let outer = outer * w.gain(r);
        for (t, w) in t_x.iter_mut().zip(row) {
            t[r] = outer * w.value();
        }
    }
}

/// As [`dense_seed`], and on through activation `g` of the layer before, whose values are `a`:
/// `diag(g') W' diag(outer)`.
#[inline(always)]
pub fn dense_seed_activated<W: Weight, const IN: usize, const OUT: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    outer: &[f32; OUT],
    g: impl Elementwise,
    a: &[f32; IN],
) -> [[f32; OUT]; IN] {
    core::array::from_fn(|i| {
        let t = core::array::from_fn(|r| outer[r] * w.gain(r) * w.rows()[r][i].value());
        g.back(a[i], a[i], t)
    })
}
