//! Derivatives of a layer's rows along directions of its input.

use crate::layers::rows::{Rows, Weight};
use crate::number::Number;

/// Of row `i`: the derivative of `W x + U h` along `R` directions.
#[inline(always)]
pub(crate) fn gate_along<N: Number, W: Weight, const IN: usize, const H: usize, const R: usize>(
    kernel: &impl Rows<H, Row = [W; IN]>,
    recurrent: &impl Rows<H, Row = [W; H]>,
    i: usize,
    d_x: &[[N; R]; IN],
    d_h: &[[N; R]; H],
) -> [N; R] {
    let mut sum = row_along(kernel, i, d_x);
    for (sum, d) in sum.iter_mut().zip(row_along(recurrent, i, d_h)) {
        *sum = *sum + d;
    }
    sum
}

/// Of row `i`: the derivative of `W x` along `R` directions.
#[inline(always)]
pub(crate) fn row_along<N: Number, W: Weight, const IN: usize, const OUT: usize, const R: usize>(
    w: &impl Rows<OUT, Row = [W; IN]>,
    i: usize,
    d_x: &[[N; R]; IN],
) -> [N; R] {
    let mut sum = [N::ZERO; R];
    if let Some(row) = w.rows().get(i) {
        for (w, d) in row.iter().zip(d_x) {
            for (sum, d) in sum.iter_mut().zip(d) {
                *sum = *sum + d.weigh(w.value());
            }
        }
    }
    sum.map(|sum| w.scaled(i, sum))
}
