//! The predictor as burn sees it: a linear path beside a small tanh network, rolled out through its
//! own predictions.

use burn::module::{Module, Param};
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::windows::{Shape, Windows};

/// y(k+1) = y(k) + step * (linear(z) + gain * network(z)), z the features of the regressor.
#[derive(Module, Debug)]
pub struct Predictor {
    linear: Linear,
    hidden: Vec<Linear>,
    last: Linear,
}

/// What stays fixed while the predictor learns.
pub struct Frame {
    /// Counts of the regressor.
    pub shape: Shape,
    /// z = features x + offset, transposed for row vectors: `[n][n]`.
    features: Tensor<2>,
    offset: Tensor<2>,
    /// Typical change of each output in one period, `[1][n_y]`.
    step: Tensor<2>,
    /// How much of that change the linear path leaves unexplained.
    gain: f32,
}

/// One batch on the device: history, inputs and targets of `rows` windows.
pub struct Batch {
    /// Past values of u, newest first, without u(k).
    past_u: Vec<Tensor<2>>,
    /// Past values of y, newest first, y(k) included.
    past_y: Vec<Tensor<2>>,
    /// Channels s(k), where there are any: the same at every step.
    channels: Option<Tensor<2>>,
    /// u(k + j), one tensor a step.
    inputs: Vec<Tensor<2>>,
    /// y(k + 1 + j), one tensor a step.
    targets: Vec<Tensor<2>>,
}

fn tensor(rows: usize, columns: usize, values: Vec<f32>, device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values, [rows, columns]), device)
}

fn matrix(m: &DMatrix<f64>, device: &Device) -> Tensor<2> {
    let values = m
        .row_iter()
        .flat_map(|r| r.iter().map(|v| *v as f32).collect::<Vec<_>>());
    tensor(m.nrows(), m.ncols(), values.collect(), device)
}

fn to_matrix(t: Tensor<2>) -> DMatrix<f64> {
    let [rows, columns] = t.dims();
    let values: Vec<f64> = t.into_data().iter::<f64>().collect();
    DMatrix::from_row_slice(rows, columns, &values)
}

impl Frame {
    /// A frame on `device` for `basis`; `step` and `gain` as in [`Predictor`].
    pub fn new(
        shape: Shape,
        basis: &Basis,
        step: &DVector<f64>,
        gain: f64,
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
        let (mut x, mut inputs, mut targets) = (Vec::new(), Vec::new(), Vec::new());
        for w in chosen {
            windows.regressor(*w, &mut x);
            inputs.extend_from_slice(windows.inputs(*w));
            targets.extend_from_slice(windows.targets(*w));
        }
        let columns = |of: &[f64], stride: usize, start: usize, width: usize| {
            let values =
                (0..rows).flat_map(|r| &of[r * stride + start..r * stride + start + width]);
            tensor(rows, width, values.map(|v| *v as f32).collect(), device)
        };
        let column = |start: usize, width: usize| columns(&x, n, start, width);
        Batch {
            past_u: (1..past_inputs).map(|lag| column(lag * n_u, n_u)).collect(),
            past_y: (0..past_outputs)
                .map(|lag| column(past_inputs * n_u + lag * n_y, n_y))
                .collect(),
            channels: (n_s > 0).then(|| column(n - n_s, n_s)),
            inputs: (0..rollout)
                .map(|j| columns(&inputs, rollout * n_u, j * n_u, n_u))
                .collect(),
            targets: (0..rollout)
                .map(|j| columns(&targets, rollout * n_y, j * n_y, n_y))
                .collect(),
        }
    }
}

impl Predictor {
    /// A predictor whose linear path is (`w` `[n_y][n]`, `b` `[n_y]`) and whose network starts at zero
    /// output: the first layers are random, the last is zero.
    pub fn new(hidden: &[usize], w: &DMatrix<f64>, b: &DVector<f64>, device: &Device) -> Self {
        let (n_y, n) = w.shape();
        let mut widths = vec![n];
        widths.extend_from_slice(hidden);
        let bias = |values: Vec<f32>| {
            let length = values.len();
            Some(Param::from_tensor(Tensor::<1>::from_data(
                TensorData::new(values, [length]),
                device,
            )))
        };
        let linear = Linear {
            weight: Param::from_tensor(matrix(&w.transpose(), device)),
            bias: bias(b.iter().map(|v| *v as f32).collect()),
        };
        let last = widths[widths.len() - 1];
        Self {
            linear,
            hidden: widths
                .windows(2)
                .map(|p| LinearConfig::new(p[0], p[1]).init(device))
                .collect(),
            last: Linear {
                weight: Param::from_tensor(tensor(last, n_y, vec![0.0; last * n_y], device)),
                bias: bias(vec![0.0; n_y]),
            },
        }
    }

    /// Predicted outputs for each step of the batch.
    fn roll_out(&self, frame: &Frame, batch: &Batch) -> Vec<Tensor<2>> {
        let (mut past_u, mut past_y) = (batch.past_u.clone(), batch.past_y.clone());
        let mut predictions = Vec::with_capacity(batch.inputs.len());
        for u in &batch.inputs {
            let mut parts = vec![u.clone()];
            parts.extend(past_u.iter().cloned());
            parts.extend(past_y.iter().cloned());
            parts.extend(batch.channels.iter().cloned());
            let z = Tensor::cat(parts, 1).matmul(frame.features.clone()) + frame.offset.clone();
            let mut h = z.clone();
            for layer in &self.hidden {
                h = layer.forward(h).tanh();
            }
            let change = self.linear.forward(z) + self.last.forward(h).mul_scalar(frame.gain);
            let y = past_y[0].clone() + change * frame.step.clone();
            past_u.insert(0, u.clone());
            past_u.truncate(frame.shape.past_inputs - 1);
            past_y.insert(0, y.clone());
            past_y.truncate(frame.shape.past_outputs);
            predictions.push(y);
        }
        predictions
    }

    /// Mean over the rollout of the squared errors, each step weighted by `weights[j]` (`[1][n_y]`).
    pub fn loss(&self, frame: &Frame, batch: &Batch, weights: &[Tensor<2>]) -> Tensor<1> {
        let predictions = self.roll_out(frame, batch);
        let steps = predictions.len() as f32;
        let errors = predictions.into_iter().zip(&batch.targets).zip(weights);
        let total = errors
            .map(|((y, target), weight)| {
                let e = (y - target.clone()) * weight.clone();
                (e.clone() * e).mean()
            })
            .reduce(|a, b| a + b);
        // A rollout has at least one step (checked where options are read).
        total.map_or_else(|| frame.step.clone().sum() * 0.0, |t| t.div_scalar(steps))
    }

    /// Root mean square error of every step, `[steps][n_y]`, over one batch.
    pub fn step_errors(&self, frame: &Frame, batch: &Batch) -> Vec<Vec<f64>> {
        let predictions = self.roll_out(frame, batch);
        let squares = predictions
            .into_iter()
            .zip(&batch.targets)
            .map(|(y, target)| {
                let e = y - target.clone();
                to_matrix((e.clone() * e).mean_dim(0))
                    .iter()
                    .map(|v| v.sqrt())
                    .collect()
            });
        squares.collect()
    }

    /// Weights as matrices: linear (W, w), then each layer of the network (W, w), all in features.
    pub fn weights(&self) -> Vec<(DMatrix<f64>, DVector<f64>)> {
        let layers = std::iter::once(&self.linear)
            .chain(&self.hidden)
            .chain(std::iter::once(&self.last));
        layers
            .map(|layer| {
                let w = to_matrix(layer.weight.val()).transpose();
                let b = layer.bias.as_ref().map_or_else(
                    || DVector::zeros(w.nrows()),
                    |b| DVector::from_vec(b.val().into_data().iter::<f64>().collect()),
                );
                (w, b)
            })
            .collect()
    }
}

/// Weights of the loss on the device: one over the size that an error at step j would usually have.
pub fn loss_weights(sizes: &[Vec<f64>], device: &Device) -> Vec<Tensor<2>> {
    sizes
        .iter()
        .map(|s| {
            tensor(
                1,
                s.len(),
                s.iter().map(|v| (1.0 / v) as f32).collect(),
                device,
            )
        })
        .collect()
}
