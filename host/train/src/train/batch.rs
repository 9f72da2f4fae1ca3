//! Windows of a training as tensors on the device.

use burn::tensor::{Device, Tensor};
use nalgebra::{DMatrix, DVector};

use super::Options;
use super::basis::Basis;
use super::matrix::{matrix, tensor};
use super::windows::{Shape, Windows};
use crate::network_table::FirstLayer;

/// Constants of the training.
pub struct Frame {
    /// Counts of the regressor.
    pub shape: Shape,
    /// z = features x + offset, transposed for row vectors: `[n][n]`.
    pub(super) features: Tensor<2>,
    pub(super) offset: Tensor<2>,
    /// Typical change of each output in one period, `[1][n_y]`.
    pub(super) step: Tensor<2>,
    /// Part of that change that the skip connection leaves unexplained.
    pub(super) gain: f32,
    /// Kind of the first layer.
    pub(super) first: FirstLayer,
    /// L of docs/explanation/controller.md, eq. 10c.
    pub(super) observer_gain: f64,
}

/// One batch on the device: history, inputs and targets of `rows` windows.
pub struct Batch {
    /// Regressors of the burn-in, `[steps rows][n]`, the oldest step first.
    pub(super) before: Option<Tensor<2>>,
    /// Past values of u, newest first, without u(k).
    pub(super) past_u: Vec<Tensor<2>>,
    /// Past values of y, newest first, y(k) included.
    pub(super) past_y: Vec<Tensor<2>>,
    /// Channels, where there are any, one tensor a correction, then s(k), which stays.
    pub(super) channels: Vec<Tensor<2>>,
    /// Measurements by which the first predictions are corrected, one tensor a step: what an
    /// observer begins with.
    pub(super) corrections: Vec<Tensor<2>>,
    /// u(k + j), one tensor a step, those of the corrections first.
    pub(super) inputs: Vec<Tensor<2>>,
    /// y(k + 1 + j), one tensor a step.
    pub(super) targets: Vec<Tensor<2>>,
}

impl Frame {
    /// A frame on `device` for `basis`; `step` and `gain` as in [`Predictor`], what the network
    /// begins with and its observer from `options`.
    pub fn new(
        shape: Shape,
        basis: &Basis,
        step: &DVector<f64>,
        gain: f64,
        options: &Options,
        device: &Device,
    ) -> Self {
        let (a, offset) = basis.affine();
        Self {
            shape,
            features: matrix(&a.transpose(), device),
            offset: matrix(
                &DMatrix::from_row_slice(1, offset.len(), offset.as_slice()),
                device,
            ),
            step: matrix(
                &DMatrix::from_row_slice(1, step.len(), step.as_slice()),
                device,
            ),
            gain: gain as f32,
            first: options.first,
            observer_gain: options.observer_gain,
        }
    }

    /// Copies the windows `chosen` to the device.
    pub fn batch(
        &self,
        windows: &Windows<'_>,
        chosen: &[usize],
        rollout: usize,
        device: &Device,
    ) -> Batch {
        let Shape {
            n_u,
            n_y,
            past_inputs,
            past_outputs,
            n_s,
        } = self.shape;
        let (rows, n) = (chosen.len(), self.shape.regressor_len());
        // An observer begins before the window, at what was measured there; a memory is warmed up
        // by what was.
        let observed = if self.observer_gain < 1.0 {
            windows.burn_in()
        } else {
            0
        };
        let (mut x, mut inputs, mut targets) = (Vec::new(), Vec::new(), Vec::new());
        let (mut measured, mut channels) = (Vec::new(), Vec::new());
        for w in chosen {
            windows.regressor_before(*w, observed, &mut x);
            channels.extend_from_slice(windows.channels_since(*w, observed));
            inputs.extend_from_slice(windows.inputs_from(*w, observed));
            measured.extend_from_slice(windows.measured_since(*w, observed));
            targets.extend_from_slice(windows.targets(*w));
        }
        let columns = |of: &[f64], stride: usize, start: usize, width: usize| {
            let values =
                (0..rows).flat_map(|r| &of[r * stride + start..r * stride + start + width]);
            tensor(rows, width, values.map(|v| *v as f32).collect(), device)
        };
        let column = |start: usize, width: usize| columns(&x, n, start, width);
        let mut before = Vec::new();
        for back in (1..=windows.burn_in() - observed).rev() {
            for w in chosen {
                windows.regressor_before(*w, back, &mut before);
            }
        }
        let before = (!before.is_empty()).then(|| {
            let values = before.iter().map(|v| *v as f32).collect();
            tensor(before.len() / n, n, values, device)
        });
        Batch {
            before,
            past_u: (1..past_inputs).map(|lag| column(lag * n_u, n_u)).collect(),
            past_y: (0..past_outputs)
                .map(|lag| column(past_inputs * n_u + lag * n_y, n_y))
                .collect(),
            channels: (0..=observed)
                .filter(|_| n_s > 0)
                .map(|j| columns(&channels, (observed + 1) * n_s, j * n_s, n_s))
                .collect(),
            corrections: (0..observed)
                .map(|j| columns(&measured, observed * n_y, j * n_y, n_y))
                .collect(),
            inputs: (0..observed + rollout)
                .map(|j| columns(&inputs, (observed + rollout) * n_u, j * n_u, n_u))
                .collect(),
            targets: (0..rollout)
                .map(|j| columns(&targets, rollout * n_y, j * n_y, n_y))
                .collect(),
        }
    }
}

impl Batch {
    /// The same with u(k) and all that follow moved by `moves`, `[rows][n_u]`; what was before k
    /// stays.
    pub fn moved(self, moves: &Tensor<2>) -> Self {
        let before = self.corrections.len();
        let inputs = self.inputs.into_iter().enumerate();
        let inputs = inputs.map(|(j, u)| if j < before { u } else { u + moves.clone() });
        Self {
            inputs: inputs.collect(),
            ..self
        }
    }
}
