//! The long short-term memory layer.

use crate::layers::along::gate_along;
use crate::layers::dense::add_dense_back;
use crate::layers::elementwise::Elementwise;
use crate::layers::gate::gate;
use crate::layers::rows::{Rows, Weight};
use crate::number::Number;

/// Weights of the gates `i` (input), `f` (forget), of the candidate `g` and of the gate `o`
/// (output), in this order.
pub struct Lstm<K, U, const H: usize> {
    /// `W`, for the input.
    pub kernel: [K; 4],
    /// `U`, for the state.
    pub recurrent: [U; 4],
    /// `b`.
    pub bias: [[f32; H]; 4],
}

/// Values of one step that its derivative needs.
#[derive(Clone, Copy)]
pub struct Step<N, const H: usize> {
    /// The new state.
    pub state: [N; H],
    /// The new cell.
    pub cell: [N; H],
    /// The cell before.
    before: [N; H],
    i: [N; H],
    f: [N; H],
    g: [N; H],
    o: [N; H],
    /// The new cell through its activation.
    squashed: [N; H],
}

impl<N: Number, const H: usize> Step<N, H> {
    /// Before the step.
    pub const ZERO: Self = Self {
        state: [N::ZERO; H],
        cell: [N::ZERO; H],
        before: [N::ZERO; H],
        i: [N::ZERO; H],
        f: [N::ZERO; H],
        g: [N::ZERO; H],
        o: [N::ZERO; H],
        squashed: [N::ZERO; H],
    };
}

/// One step, with `s` the gates' activation and `a` the candidate's and the cell's: each of `i, f,
/// o` is `s(W x + U h + b)`, `g = a(W x + U h + b)`, `c' = f c + i g`, `h' = o a(c')`.
///
/// Cost: `4 H (IN + H)` multiply-adds.
#[inline(always)]
pub fn step<N: Number, W: Weight, const IN: usize, const H: usize>(
    layer: &Lstm<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    s: impl Elementwise,
    a: impl Elementwise,
    x: &[N; IN],
    (h, c): (&[N; H], &[N; H]),
    step: &mut Step<N, H>,
) {
    step.before = *c;
    let [kernel_i, kernel_f, kernel_g, kernel_o] = &layer.kernel;
    let [recurrent_i, recurrent_f, recurrent_g, recurrent_o] = &layer.recurrent;
    let [bias_i, bias_f, bias_g, bias_o] = &layer.bias;
    gate(kernel_i, recurrent_i, bias_i, s, x, h, &mut step.i);
    gate(kernel_f, recurrent_f, bias_f, s, x, h, &mut step.f);
    gate(kernel_g, recurrent_g, bias_g, a, x, h, &mut step.g);
    gate(kernel_o, recurrent_o, bias_o, s, x, h, &mut step.o);
    for (k, c) in c.iter().enumerate() {
        let cell = step.f[k] * *c + step.i[k] * step.g[k];
        let squashed = a.value(cell);
        step.cell[k] = cell;
        step.squashed[k] = squashed;
        step.state[k] = step.o[k] * squashed;
    }
}

/// Derivatives of the new state and cell along `R` directions, of which `d_x`, `d_h` and `d_c` are
/// the input's, the state's and the cell's part.
///
/// Cost: `4 H (IN + H) R` multiply-adds; taken backward, `R` is the number of results instead.
#[inline(always)]
pub fn step_along<N: Number, W: Weight, const IN: usize, const H: usize, const R: usize>(
    layer: &Lstm<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    s: impl Elementwise,
    a: impl Elementwise,
    step: &Step<N, H>,
    d_x: &[[N; R]; IN],
    (d_h, d_c): (&[[N; R]; H], &[[N; R]; H]),
) -> ([[N; R]; H], [[N; R]; H]) {
    let [kernel_i, kernel_f, kernel_g, kernel_o] = &layer.kernel;
    let [recurrent_i, recurrent_f, recurrent_g, recurrent_o] = &layer.recurrent;
    let (mut d_state, mut d_cell) = ([[N::ZERO; R]; H], [[N::ZERO; R]; H]);
    for k in 0..H {
        let (i, f, g, o) = (step.i[k], step.f[k], step.g[k], step.o[k]);
        let squashed = step.squashed[k];
        let by_i = s.slope(i, i) * g;
        let by_f = s.slope(f, f) * step.before[k];
        let by_g = a.slope(g, g) * i;
        let by_o = s.slope(o, o) * squashed;
        let by_cell = o * a.slope(squashed, squashed);
        let d_i = gate_along(kernel_i, recurrent_i, k, d_x, d_h);
        let d_f = gate_along(kernel_f, recurrent_f, k, d_x, d_h);
        let d_g = gate_along(kernel_g, recurrent_g, k, d_x, d_h);
        let d_o = gate_along(kernel_o, recurrent_o, k, d_x, d_h);
        for r in 0..R {
            let cell = f * d_c[k][r] + by_i * d_i[r] + by_f * d_f[r] + by_g * d_g[r];
            d_cell[k][r] = cell;
            d_state[k][r] = by_o * d_o[r] + by_cell * cell;
        }
    }
    (d_state, d_cell)
}

/// Adjoints of the new state and cell to adjoints of the input, which are overwritten, and of the
/// state and cell before.
#[inline(always)]
pub fn step_back<N: Number, W: Weight, const IN: usize, const H: usize, const R: usize>(
    layer: &Lstm<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    s: impl Elementwise,
    a: impl Elementwise,
    step: &Step<N, H>,
    (t_h, t_c): (&mut [[N; R]; H], &mut [[N; R]; H]),
    t_x: &mut [[N; R]; IN],
) {
    let mut t = [*t_h; 4];
    for k in 0..H {
        let (i, f, g, o) = (step.i[k], step.f[k], step.g[k], step.o[k]);
        let squashed = step.squashed[k];
        let by_cell = o * a.slope(squashed, squashed);
        let by_o = s.slope(o, o) * squashed;
        for r in 0..R {
            let t_new = t_h[k][r];
            let t_cell = t_c[k][r] + by_cell * t_new;
            t[0][k][r] = s.slope(i, i) * g * t_cell;
            t[1][k][r] = s.slope(f, f) * step.before[k] * t_cell;
            t[2][k][r] = a.slope(g, g) * i * t_cell;
            t[3][k][r] = by_o * t_new;
            t_c[k][r] = f * t_cell;
        }
    }
    *t_x = [[N::ZERO; R]; IN];
    *t_h = [[N::ZERO; R]; H];
    for ((kernel, recurrent), t) in layer.kernel.iter().zip(&layer.recurrent).zip(&t) {
        add_dense_back(kernel, t, t_x);
        add_dense_back(recurrent, t, t_h);
    }
}
