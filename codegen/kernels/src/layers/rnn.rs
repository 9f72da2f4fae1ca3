//! The simple recurrent layer.

use crate::layers::dense::{add_dense_back, weighted_sum};
use crate::layers::elementwise::Elementwise;
use crate::number::Number;

/// Weights: of the input, of the state, and bias.
pub struct Rnn<const IN: usize, const H: usize> {
    /// `W`.
    pub kernel: [[f32; IN]; H],
    /// `U`.
    pub recurrent: [[f32; H]; H],
    /// `b`.
    pub bias: [f32; H],
}

/// What one step leaves for its derivative.
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
pub fn step<N: Number, const IN: usize, const H: usize>(
    layer: &Rnn<IN, H>,
    g: impl Elementwise,
    x: &[N; IN],
    h: &[N; H],
    step: &mut Step<N, H>,
) {
    let rows = layer.kernel.iter().zip(&layer.recurrent).zip(&layer.bias);
    for (new, ((w, u), b)) in step.state.iter_mut().zip(rows) {
        let z = weighted_sum(weighted_sum(N::constant(*b), w, x), u, h);
        *new = g.value(z);
    }
}

/// Adjoints of the new state to adjoints of the input, which are overwritten, and of the state before.
#[inline(always)]
pub fn step_back<N: Number, const IN: usize, const H: usize, const R: usize>(
    layer: &Rnn<IN, H>,
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
