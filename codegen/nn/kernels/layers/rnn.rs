//! The simple recurrent layer.

use crate::layers::dense::add_dense_back;
use crate::layers::elementwise::Elementwise;
use crate::layers::gate::gate;
use crate::layers::rows::{Rows, Weight};
use crate::number::Number;

/// Weights: of the input, of the state, and bias.
pub struct Rnn<K, U, const H: usize> {
    /// `W`.
    pub kernel: K,
    /// `U`.
    pub recurrent: U,
    /// `b`.
    pub bias: [f32; H],
}

/// Values of one step that its derivative needs.
#[derive(Clone, Copy)]
pub struct Step<N, const H: usize> {
    /// The new state.
    pub state: [N; H],
}

impl<N: Number, const H: usize> Step<N, H> {
    /// Before the step.
    pub const ZERO: Self = Self {
        state: [N::ZERO; H],
    };
}

/// One step: `h' = g(W x + U h + b)`.
#[inline(always)]
pub fn step<N: Number, W: Weight, const IN: usize, const H: usize>(
    layer: &Rnn<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    g: impl Elementwise,
    x: &[N; IN],
    h: &[N; H],
    step: &mut Step<N, H>,
) {
    gate(
        &layer.kernel,
        &layer.recurrent,
        &layer.bias,
        g,
        x,
        h,
        &mut step.state,
    );
}

/// Adjoints of the new state to adjoints of the input, which are overwritten, and of the state
/// before.
#[inline(always)]
pub fn step_back<N: Number, W: Weight, const IN: usize, const H: usize, const R: usize>(
    layer: &Rnn<impl Rows<H, Row = [W; IN]>, impl Rows<H, Row = [W; H]>, H>,
    g: impl Elementwise,
    step: &Step<N, H>,
    t_h: &mut [[N; R]; H],
    t_x: &mut [[N; R]; IN],
) {
    let mut t_z = *t_h;
    for (t, a) in t_z.iter_mut().zip(&step.state) {
        let slope = g.slope(*a, *a);
        for t in t {
            *t = slope * *t;
        }
    }
    *t_x = [[N::ZERO; R]; IN];
    *t_h = [[N::ZERO; R]; H];
    add_dense_back(&layer.kernel, &t_z, t_x);
    add_dense_back(&layer.recurrent, &t_z, t_h);
}
