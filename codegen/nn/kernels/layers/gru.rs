//! The gated recurrent unit, with the reset gate before or after the recurrent product.

use crate::layers::along::{gate_along, row_along};
use crate::layers::dense::{add_dense_back, dense, weighted_sum};
use crate::layers::elementwise::Elementwise;
use crate::layers::gate::gate;
use crate::layers::rows::{Rows, Weight};
use crate::number::Number;

/// Weights of the gates `z` (update), `r` (reset) and of the candidate `n`, in this order.
pub struct Gru<K, U, const H: usize> {
    /// `W`, for the input.
    pub kernel: [K; 3],
    /// `U`, for the state.
    pub recurrent: [U; 3],
    /// `b`; for the gates, that of the input and that of the state together.
    pub bias: [[f32; H]; 3],
    /// `c`, the candidate's bias inside the reset; nought where the reset comes before the product.
    pub inner_bias: [f32; H],
    /// True if the reset comes after the recurrent product (Keras: `reset_after`, ONNX:
    /// `linear_before_reset`).
    pub reset_after: bool,
}

/// Values of one step that its derivative needs.
#[derive(Clone, Copy)]
pub struct Step<N, const H: usize> {
    /// The new state.
    pub state: [N; H],
    /// The state before.
    before: [N; H],
    z: [N; H],
    r: [N; H],
    n: [N; H],
    /// `U_n h + c`, where the reset comes after the product.
    inner: [N; H],
}

impl<N: Number, const H: usize> Step<N, H> {
    /// Before the step.
    pub const ZERO: Self = Self {
        state: [N::ZERO; H],
        before: [N::ZERO; H],
        z: [N::ZERO; H],
        r: [N::ZERO; H],
        n: [N::ZERO; H],
        inner: [N::ZERO; H],
    };
}

/// One step, with `s` the gates' activation and `g` the candidate's:
///
/// `z = s(W_z x + U_z h + b_z)`, `r = s(W_r x + U_r h + b_r)`, `h' = z h + (1 - z) n` with
/// `n = g(W_n x + b_n + r (U_n h + c))` (reset after) or `n = g(W_n x + b_n + U_n (r h))` (before).
///
/// Cost: `3 H (IN + H)` multiply-adds.
#[inline(always)]
pub fn step<N: Number, W: Weight, const IN: usize, const H: usize>(
    layer: &Gru<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    s: impl Elementwise,
    g: impl Elementwise,
    x: &[N; IN],
    h: &[N; H],
    step: &mut Step<N, H>,
) {
    let [kernel_z, kernel_r, kernel_n] = &layer.kernel;
    let [recurrent_z, recurrent_r, recurrent_n] = &layer.recurrent;
    let [bias_z, bias_r, bias_n] = &layer.bias;
    step.before = *h;
    gate(kernel_z, recurrent_z, bias_z, s, x, h, &mut step.z);
    gate(kernel_r, recurrent_r, bias_r, s, x, h, &mut step.r);
    if layer.reset_after {
        dense(recurrent_n, &layer.inner_bias, h, &mut step.inner);
        let rows = kernel_n.rows().iter().zip(bias_n);
        let gates = step.r.iter().zip(&step.inner);
        for (i, (n, ((w, b), (r, inner)))) in step.n.iter_mut().zip(rows.zip(gates)).enumerate() {
            let bias = N::constant(*b);
            let by_input = kernel_n.end(i, weighted_sum(kernel_n.start(bias), w, x), bias);
            *n = g.value(by_input + *r * *inner);
        }
    } else {
        let mut kept = *h;
        for (kept, r) in kept.iter_mut().zip(&step.r) {
            *kept = *kept * *r;
        }
        gate(kernel_n, recurrent_n, bias_n, g, x, &kept, &mut step.n);
    }
    let gates = step.z.iter().zip(&step.n).zip(h);
    for (new, ((z, n), h)) in step.state.iter_mut().zip(gates) {
        *new = *n + *z * (*h - *n);
    }
}

/// Derivatives of the new state along `R` directions, of which `d_x` and `d_h` are the input's and
/// the state's part.
///
/// Cost: `3 H (IN + H) R` multiply-adds; taken backward, `R` is the number of results instead.
#[inline(always)]
pub fn step_along<N: Number, W: Weight, const IN: usize, const H: usize, const R: usize>(
    layer: &Gru<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    s: impl Elementwise,
    g: impl Elementwise,
    step: &Step<N, H>,
    d_x: &[[N; R]; IN],
    d_h: &[[N; R]; H],
) -> [[N; R]; H] {
    let [kernel_z, kernel_r, kernel_n] = &layer.kernel;
    let [recurrent_z, recurrent_r, recurrent_n] = &layer.recurrent;
    // Where the reset comes before the product: of r h.
    let mut d_kept = *d_h;
    if !layer.reset_after {
        for i in 0..H {
            let by_r = s.slope(step.r[i], step.r[i]) * step.before[i];
            let sum = gate_along(kernel_r, recurrent_r, i, d_x, d_h);
            for k in 0..R {
                d_kept[i][k] = by_r * sum[k] + step.r[i] * d_h[i][k];
            }
        }
    }
    let mut d_new = [[N::ZERO; R]; H];
    for i in 0..H {
        let (z, n, r) = (step.z[i], step.n[i], step.r[i]);
        let by_z = s.slope(z, z) * (step.before[i] - n);
        let by_n = g.slope(n, n) * (N::constant(1.0) - z);
        let d_z = gate_along(kernel_z, recurrent_z, i, d_x, d_h);
        let mut d_n = row_along(kernel_n, i, d_x);
        let d_inner = row_along(recurrent_n, i, &d_kept);
        if layer.reset_after {
            let by_r = s.slope(r, r) * step.inner[i];
            let d_r = gate_along(kernel_r, recurrent_r, i, d_x, d_h);
            for k in 0..R {
                d_n[k] = d_n[k] + (by_r * d_r[k] + r * d_inner[k]);
            }
        } else {
            for k in 0..R {
                d_n[k] = d_n[k] + d_inner[k];
            }
        }
        for k in 0..R {
            d_new[i][k] = by_z * d_z[k] + z * d_h[i][k] + by_n * d_n[k];
        }
    }
    d_new
}

/// Adjoints of the new state to adjoints of the input, which are overwritten, and of the state
/// before.
#[inline(always)]
pub fn step_back<N: Number, W: Weight, const IN: usize, const H: usize, const R: usize>(
    layer: &Gru<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    s: impl Elementwise,
    g: impl Elementwise,
    step: &Step<N, H>,
    t_h: &mut [[N; R]; H],
    t_x: &mut [[N; R]; IN],
) {
    let [kernel_z, kernel_r, kernel_n] = &layer.kernel;
    let [recurrent_z, recurrent_r, recurrent_n] = &layer.recurrent;
    let (mut t_z, mut t_r, mut t_n) = (*t_h, *t_h, *t_h);
    for i in 0..H {
        let (z, n) = (step.z[i], step.n[i]);
        let by_z = s.slope(z, z) * (step.before[i] - n);
        let by_n = g.slope(n, n) * (N::constant(1.0) - z);
        for k in 0..R {
            let t = t_h[i][k];
            t_z[i][k] = by_z * t;
            t_n[i][k] = by_n * t;
            t_h[i][k] = z * t;
        }
    }
    *t_x = [[N::ZERO; R]; IN];
    add_dense_back(kernel_n, &t_n, t_x);
    if layer.reset_after {
        let mut t_inner = t_n;
        for i in 0..H {
            let r = step.r[i];
            let by_r = s.slope(r, r) * step.inner[i];
            for k in 0..R {
                t_r[i][k] = by_r * t_n[i][k];
                t_inner[i][k] = r * t_n[i][k];
            }
        }
        add_dense_back(recurrent_n, &t_inner, t_h);
    } else {
        let mut t_kept = [[N::ZERO; R]; H];
        add_dense_back(recurrent_n, &t_n, &mut t_kept);
        for i in 0..H {
            let r = step.r[i];
            let by_r = s.slope(r, r) * step.before[i];
            for k in 0..R {
                t_r[i][k] = by_r * t_kept[i][k];
                t_h[i][k] = t_h[i][k] + r * t_kept[i][k];
            }
        }
    }
    add_dense_back(kernel_z, &t_z, t_x);
    add_dense_back(kernel_r, &t_r, t_x);
    add_dense_back(recurrent_z, &t_z, t_h);
    add_dense_back(recurrent_r, &t_r, t_h);
}
