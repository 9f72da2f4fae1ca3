//! Functions that the layers with gates share.

use crate::layers::dense::weighted_sum;
use crate::layers::elementwise::Elementwise;
use crate::layers::rows::{Rows, Weight};
use crate::number::Number;

/// `y = s(W x + U h + b)`, of the layers that remember `h`.
#[inline(always)]
pub(crate) fn gate<N: Number, W: Weight, const IN: usize, const H: usize>(
    kernel: &impl Rows<H, Row = [W; IN]>,
    recurrent: &impl Rows<H, Row = [W; H]>,
    bias: &[f32; H],
    s: impl Elementwise,
    x: &[N; IN],
    h: &[N; H],
    y: &mut [N; H],
) {
    let rows = kernel.rows().iter().zip(recurrent.rows()).zip(bias);
    for (r, (y, ((w, u), b))) in y.iter_mut().zip(rows).enumerate() {
        let bias = N::constant(*b);
        let by_input = kernel.end(r, weighted_sum(kernel.start(bias), w, x), bias);
        let sum = weighted_sum(recurrent.start(by_input), u, h);
        *y = s.value(recurrent.end(r, sum, by_input));
    }
}
