//! From weights on features to weights on the raw regressor: what the firmware multiplies.

use crate::network_table::FirstLayer;
use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::network::Predictor;
use super::windows::Shape;

/// y(k+1) = y(k) + linear x + network(x), x the raw regressor in model units, weights in `f32`.
#[derive(Clone, Debug, PartialEq)]
pub struct Folded {
    /// Counts of the regressor.
    pub shape: Shape,
    /// The linear path: `[n_y][n]`.
    pub linear: Vec<Vec<f32>>,
    /// Kind of the first layer.
    pub first: FirstLayer,
    /// The first layer, if it remembers.
    pub remembering: Option<Remembering>,
    /// The other hidden layers and a linear last one: (weights `[out][in]`, bias `[out]`).
    pub layers: Vec<(Vec<Vec<f32>>, Vec<f32>)>,
}

/// A GRU or an LSTM, gate after gate in the order of the printed kernels.
#[derive(Clone, Debug, PartialEq)]
pub struct Remembering {
    /// Size of the state.
    pub units: usize,
    /// `[gates][units][n]`.
    pub kernel: Vec<f32>,
    /// `[gates][units][units]`.
    pub recurrent: Vec<f32>,
    /// `[gates][units]`.
    pub bias: Vec<f32>,
    /// `[units]` of a GRU, else empty.
    pub inner_bias: Vec<f32>,
}

fn rows(m: &DMatrix<f64>) -> Vec<Vec<f32>> {
    m.row_iter()
        .map(|r| r.iter().map(|v| *v as f32).collect())
        .collect()
}

impl Folded {
    /// Folds `basis`, the typical change `step` and the network's `gain` into the weights of
    /// `predictor`.
    pub(super) fn new(
        basis: &Basis,
        (step, gain): (&DVector<f64>, f64),
        predictor: &Predictor,
        first: FirstLayer,
        shape: Shape,
    ) -> Self {
        let (a, offset) = basis.affine();
        let weights = predictor.weights();
        let remembering = predictor.cell().map(|cell| {
            let (w, b, recurrent, inner_bias) = cell.matrices();
            let narrow = |values: &[f64]| values.iter().map(|v| *v as f32).collect();
            Remembering {
                units: recurrent.ncols(),
                kernel: rows(&(&w * &a)).concat(),
                recurrent: rows(&recurrent).concat(),
                bias: narrow((w * &offset + b).as_slice()),
                inner_bias: narrow(&inner_bias),
            }
        });
        let by_step = DMatrix::from_diagonal(step);
        let (w, b) = &weights[0];
        let linear = &by_step * w * &a;
        let linear_bias = &by_step * (w * &offset + b);
        let last = weights.len() - 2;
        let layers = weights[1..].iter().enumerate().map(|(i, (w, b))| {
            let (mut w, mut b) = if i == 0 && remembering.is_none() {
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
            first,
            remembering,
        }
    }
}
