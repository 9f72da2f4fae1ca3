//! Convolution over one or two dimensions, channels last.

use crate::layers::dense::weighted_sum;
use crate::layers::rows::{Rows, Weight};
use crate::layers::window::Window;
use crate::number::Number;

/// `y(p, q, f) = b(f) + sum of w(f, i, j, c) x(p s + i d - before, q s + j d - before, c)`, nothing
/// beyond the edges.
///
/// Shapes: `x` is an image of cells of `C` channels, `y` one of cells of `F` filters; `w` is
/// `[F][KH][KW][C]`. Cost: `C F KH KW` multiply-adds for each cell of `y`.
#[inline(always)]
pub fn convolve<
    N: Number,
    W: Weight,
    const LEN: usize,
    const OUT: usize,
    const C: usize,
    const F: usize,
    const KH: usize,
    const KW: usize,
>(
    window: &Window,
    w: &impl Rows<F, Row = [[[W; C]; KW]; KH]>,
    b: &[f32; F],
    x: &[N; LEN],
    y: &mut [N; OUT],
) {
    let mut outputs = y.chunks_exact_mut(F);
    for p in 0..window.output[0] {
        for q in 0..window.output[1] {
            let Some(y) = outputs.next() else { return };
            for (y, b) in y.iter_mut().zip(b) {
                *y = w.start(N::constant(*b));
            }
            for i in 0..KH {
                for j in 0..KW {
                    let place = window.place(p, q, i, j);
                    let Some(cell) = place.and_then(|at| x.chunks_exact(C).nth(at)) else {
                        continue;
                    };
                    for (y, w) in y.iter_mut().zip(w.rows()) {
                        *y = weighted_sum(*y, &w[i][j], cell);
                    }
                }
            }
            for (f, (y, b)) in y.iter_mut().zip(b).enumerate() {
                *y = w.end(f, *y, N::constant(*b));
            }
        }
    }
}

/// Adjoints of `y` to adjoints of `x`.
#[inline(always)]
pub fn convolve_back<
    N: Number,
    W: Weight,
    const LEN: usize,
    const OUT: usize,
    const C: usize,
    const F: usize,
    const KH: usize,
    const KW: usize,
    const R: usize,
>(
    window: &Window,
    w: &impl Rows<F, Row = [[[W; C]; KW]; KH]>,
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; LEN],
) {
    *t_x = [[N::ZERO; R]; LEN];
    let mut outputs = t_y.chunks_exact(F);
    for p in 0..window.output[0] {
        for q in 0..window.output[1] {
            let Some(t_y) = outputs.next() else { return };
            for i in 0..KH {
                for j in 0..KW {
                    let place = window.place(p, q, i, j);
                    let Some(cell) = place.and_then(|at| t_x.chunks_exact_mut(C).nth(at)) else {
                        continue;
                    };
                    for (f, (t_y, row)) in t_y.iter().zip(w.rows()).enumerate() {
                        let t_y = t_y.map(|t| w.scaled(f, t));
                        for (t_x, w) in cell.iter_mut().zip(&row[i][j]) {
                            for (t_x, t_y) in t_x.iter_mut().zip(&t_y) {
                                *t_x = *t_x + t_y.weigh(w.value());
                            }
                        }
                    }
                }
            }
        }
    }
}
