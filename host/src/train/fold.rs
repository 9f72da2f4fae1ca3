//! From weights on features to weights on the raw regressor: what the firmware multiplies.

use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::windows::Shape;

/// y(k+1) = y(k) + linear x + network(x), x the raw regressor in model units, weights in `f32`.
#[derive(Clone, Debug, PartialEq)]
pub struct Folded {
    /// Counts of the regressor.
    pub shape: Shape,
    /// The linear path: `[n_y][n]`.
    pub linear: Vec<Vec<f32>>,
    /// tanh layers and a linear last one: (weights `[out][in]`, bias `[out]`).
    pub layers: Vec<(Vec<Vec<f32>>, Vec<f32>)>,
}

fn rows(m: &DMatrix<f64>) -> Vec<Vec<f32>> {
    m.row_iter()
        .map(|r| r.iter().map(|v| *v as f32).collect())
        .collect()
}

impl Folded {
    /// Folds `basis`, the typical change `step` and the network's `gain` into `weights`, which hold
    /// the linear path first and then the network's layers.
    pub(super) fn new(
        basis: &Basis,
        step: &DVector<f64>,
        gain: f64,
        weights: &[(DMatrix<f64>, DVector<f64>)],
        shape: Shape,
    ) -> Self {
        let (a, offset) = basis.affine();
        let by_step = DMatrix::from_diagonal(step);
        let (w, b) = &weights[0];
        let linear = &by_step * w * &a;
        let linear_bias = &by_step * (w * &offset + b);
        let last = weights.len() - 2;
        let layers = weights[1..].iter().enumerate().map(|(i, (w, b))| {
            let (mut w, mut b) = if i == 0 {
                (w * &a, w * &offset + b)
            } else {
                (w.clone(), b.clone())
            };
            if i == last {
                w = &by_step * w * gain;
                // The linear path has no bias of its own on the chip: the last layer carries both.
                b = &by_step * b * gain + &linear_bias;
            }
            (rows(&w), b.iter().map(|v| *v as f32).collect())
        });
        Self {
            shape,
            linear: rows(&linear),
            layers: layers.collect(),
        }
    }
}
