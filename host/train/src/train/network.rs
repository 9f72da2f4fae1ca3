//! The predictor as burn sees it: a linear skip connection beside a small network, rolled out
//! through its own predictions.

use crate::network_table::FirstLayer;
use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::{DMatrix, DVector};

use super::batch::{Batch, Frame};
use super::cell::{Cell, State, Weights};
use super::linear::{Draws, Linear};
use super::matrix::{matrix, tensor, to_matrix};

/// y(k+1) = y(k) + step * (linear(z) + gain * network(z)), z the features of the regressor.
#[derive(Module, Debug)]
pub struct Predictor {
    linear: Linear,
    cell: Option<Cell>,
    hidden: Vec<Linear>,
    last: Linear,
}

impl Predictor {
    /// A predictor whose linear path is (`w` `[n_y][n]`, `b` `[n_y]`) and whose network starts at
    /// zero output: the first layers are random, the last is zero.
    pub fn new(
        (first, hidden): (FirstLayer, &[usize]),
        w: &DMatrix<f64>,
        b: &DVector<f64>,
        draws: &mut Draws,
        device: &Device,
    ) -> Self {
        let (n_y, n) = w.shape();
        let units = hidden.first().copied().unwrap_or(0);
        let cell = Cell::new(first, (n, units), draws, device);
        let mut widths = match cell {
            Some(_) => vec![],
            None => vec![n],
        };
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
            cell,
            hidden: widths
                .windows(2)
                .map(|p| Linear::drawn(p[0], p[1], draws))
                .collect(),
            last: Linear {
                weight: Param::from_tensor(tensor(last, n_y, vec![0.0; last * n_y], device)),
                bias: bias(vec![0.0; n_y]),
            },
        }
    }

    /// Predicted outputs for each step of the batch, those that are corrected left out.
    pub fn roll_out(&self, frame: &Frame, batch: &Batch) -> Vec<Tensor<2>> {
        let (mut past_u, mut past_y) = (batch.past_u.clone(), batch.past_y.clone());
        let mut predictions = Vec::with_capacity(batch.targets.len());
        let mut corrections = batch.corrections.iter();
        let mut channels = batch.channels.iter();
        let mut channel = None;
        let cell = self.cell.as_ref().map(Cell::learned);
        let mut state = cell.as_ref().map(|cell| warmed_up(cell, frame, batch));
        for u in &batch.inputs {
            let mut parts = vec![u.clone()];
            parts.extend(past_u.iter().cloned());
            parts.extend(past_y.iter().cloned());
            channel = channels.next().or(channel);
            parts.extend(channel.cloned());
            let z = Tensor::cat(parts, 1).matmul(frame.features.clone()) + frame.offset.clone();
            let mut h = z.clone();
            if let (Some(cell), Some(state)) = (&cell, &mut state) {
                *state = cell.step(cell.by_input(z.clone()), state);
                h = state[0].clone();
            }
            for (i, layer) in self.hidden.iter().enumerate() {
                let sum = layer.forward(h);
                h = match frame.first {
                    FirstLayer::Relu if i == 0 => burn::tensor::activation::relu(sum),
                    _ => sum.tanh(),
                };
            }
            let change = self.linear.forward(z) + self.last.forward(h).mul_scalar(frame.gain);
            let predicted = past_y[0].clone() + change * frame.step.clone();
            let y = match corrections.next() {
                Some(measured) => {
                    let innovation = measured.clone() - predicted.clone();
                    predicted + innovation.mul_scalar(frame.observer_gain)
                }
                None => {
                    predictions.push(predicted.clone());
                    predicted
                }
            };
            past_u.insert(0, u.clone());
            past_u.truncate(frame.shape.past_inputs - 1);
            past_y.insert(0, y);
            past_y.truncate(frame.shape.past_outputs);
        }
        predictions
    }

    /// Mean over the rollout of the squared errors, each step weighted by `weights[j]`
    /// (`[1][n_y]`).
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

    /// The recurrent first layer, where there is one.
    pub fn cell(&self) -> Option<&Cell> {
        self.cell.as_ref()
    }

    /// Weights as matrices, without a recurrent layer: linear (W, w), then each layer of the
    /// network (W, w), all in features.
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

/// Steps of a burn-in that are learned from; before them the state is only computed.
const LEARNED_WARM_UP: usize = 8;

/// Hidden state after the burn-in, from rest: back-propagation through time is truncated there.
fn warmed_up(cell: &Weights, frame: &Frame, batch: &Batch) -> State {
    let rows = batch.inputs.first().map_or(0, |u| u.dims()[0]);
    let Some(before) = &batch.before else {
        return cell.rest(rows);
    };
    let steps = before.dims()[0] / rows.max(1);
    let still = cell.still();
    let plain = |t: &Tensor<2>| t.clone().inner();
    let count = steps.saturating_sub(LEARNED_WARM_UP);
    let mut state = still.rest(rows);
    if count > 0 {
        let x = plain(before).narrow(0, 0, count * rows);
        let z = x.matmul(plain(&frame.features)) + plain(&frame.offset);
        let by_input = still.by_input(z);
        for step in 0..count {
            state = still.step(by_input.clone().narrow(0, step * rows, rows), &state);
        }
    }
    let mut state: State = state.into_iter().map(Tensor::autodiff).collect();
    let x = before
        .clone()
        .narrow(0, count * rows, (steps - count) * rows);
    let z = x.matmul(frame.features.clone()) + frame.offset.clone();
    let by_input = cell.by_input(z);
    for step in 0..steps - count {
        state = cell.step(by_input.clone().narrow(0, step * rows, rows), &state);
    }
    state
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

#[cfg(test)]
pub(super) mod tests {
    use sinew_model::evaluate::advance;
    use sinew_model::spec::{ControlSpec, ModelSpec, OutputForm, Signal};

    use super::super::Options;
    use super::super::basis::Basis;
    use super::super::fold::Folded;
    use super::super::layers;
    use super::super::windows::{Shape, Windows};
    use super::*;
    use crate::train::Scaled;

    const SHAPE: Shape = Shape {
        n_u: 1,
        n_y: 2,
        past_inputs: 2,
        past_outputs: 3,
        n_s: 1,
    };

    /// Sums of sines that repeat nowhere.
    fn episode() -> Scaled {
        let steps = 60;
        let wave = |k: usize, c: usize| ((k * (c + 3)) as f64 * 0.37).sin() * 0.6;
        let rows = |count: usize, width: usize, from: usize| -> Vec<f64> {
            let each = (0..count).flat_map(|k| (0..width).map(move |c| wave(k, from + c)));
            each.collect()
        };
        Scaled {
            u: rows(steps, 1, 0),
            y: rows(steps + 1, 2, 1),
            measured: rows(steps + 1, 2, 1),
            channels: rows(steps + 1, 1, 5),
            sensitivities: vec![],
            steps,
        }
    }

    /// The model that the firmware gets.
    pub fn spec(folded: &Folded, shape: Shape) -> ModelSpec {
        let signals = |count: usize| {
            let signal = |_| Signal {
                name: "s".into(),
                unit: "1".into(),
                span: 1.0,
                offset: 0.0,
            };
            (0..count).map(signal).collect()
        };
        ModelSpec {
            name: "test".into(),
            period_s: 0.01,
            inputs: signals(shape.n_u),
            outputs: signals(shape.n_y),
            channels: signals(shape.n_s),
            past_inputs: shape.past_inputs,
            past_outputs: shape.past_outputs,
            form: OutputForm::Increment,
            state: None,
            skip: Some(folded.linear.concat()),
            layers: layers(folded).expect("folded layers are whole"),
            control: ControlSpec {
                horizon: 1,
                control_horizon: 1,
                move_blocks: vec![],
                first_step: 1,
                tracking_weight: vec![],
                move_suppression: vec![],
                command_weight: 0.0,
                budget: None,
                observer_gain: 1.0,
                lower: vec![],
                upper: vec![],
                rate_limit: vec![],
                safe: vec![],
                disturbance_gain: 0.0,
                iterations: 1,
                max_missing_samples: 0,
                value: None,
            },
            soft_sensor: None,
            golden: vec![],
        }
    }

    /// Largest difference of any output over burn-in and rollout, and how far the network moves an
    /// output.
    fn difference(first: FirstLayer, observer_gain: f64) -> (f64, f64) {
        const ROLLOUT: usize = 6;
        let options = Options {
            first,
            observer_gain,
            ..Options::default()
        };
        let burn_in = options.burn_in();
        let episodes = [episode()];
        let windows = Windows::new(SHAPE, burn_in, ROLLOUT, &episodes);
        let x = windows.regressors();
        let basis = Basis::fit(&SHAPE, &x);
        let step = DVector::from_vec(vec![0.2, 0.3]);
        let device = Device::default().autodiff();
        let gain = 0.7;
        let frame = Frame::new(SHAPE, &basis, &step, gain, &options, &device);
        let n = SHAPE.regressor_len();
        let w = DMatrix::from_fn(SHAPE.n_y, n, |r, c| 0.05 * ((r + 3 * c) as f64).cos());
        let b = DVector::from_vec(vec![0.1, -0.1]);
        let mut draws = Draws::new(7, &device);
        let mut predictor = Predictor::new((first, &[5, 4]), &w, &b, &mut draws, &device);
        // Drawn, so that the network says something.
        predictor.last = Linear::drawn(4, SHAPE.n_y, &mut draws);
        let chosen: Vec<usize> = (0..windows.len()).collect();
        let batch = frame.batch(&windows, &chosen, ROLLOUT, &device);
        let found = predictor.roll_out(&frame, &batch);

        let folded = Folded::new(&basis, (&step, gain), &predictor, first, SHAPE);
        let spec = spec(&folded, SHAPE);
        let linear = {
            let mut spec = spec.clone();
            for layer in &mut spec.layers {
                if let sinew_model::spec::Layer::Dense(dense) = layer {
                    dense.weights.fill(0.0);
                }
            }
            spec
        };
        let (mut worst, mut said) = (0.0_f64, 0.0_f64);
        for w in &chosen {
            let mut memory = vec![0.0; spec.hidden_state_len()];
            // What was measured, or what the firmware's estimator made of it
            // (docs/explanation/controller.md, eq. 10c).
            let mut observed = vec![];
            for back in (1..=burn_in).rev() {
                let mut x = Vec::new();
                windows.regressor_before(*w, back, &mut x);
                entered(&mut x, &observed);
                let (predicted, next) = advance(&spec, &[x, memory].concat());
                memory = next;
                let measured = &windows.measured_since(*w, back)[..SHAPE.n_y];
                let both = predicted.iter().zip(measured);
                observed.splice(0..0, both.map(|(p, y)| p + observer_gain * (y - p)));
            }
            let mut x = Vec::new();
            windows.regressor(*w, &mut x);
            entered(&mut x, &observed);
            for (j, y) in found.iter().enumerate() {
                if j > 0 {
                    x[1] = x[0];
                    x[0] = windows.inputs(*w)[j];
                }
                let point = [x.clone(), memory.clone()].concat();
                let (exact, next) = advance(&spec, &point);
                said = said.max((exact[0] - advance(&linear, &point).0[0]).abs());
                memory = next;
                let y = to_matrix(y.clone());
                for r in 0..SHAPE.n_y {
                    worst = worst.max((y[(*w, r)] - exact[r]).abs());
                }
                x.copy_within(2..6, 4);
                x[2..4].copy_from_slice(&exact);
            }
        }
        (worst, said)
    }

    /// Puts what was observed, newest first, in the place of what was measured.
    fn entered(x: &mut [f64], observed: &[f64]) {
        let outputs = &mut x[2..8];
        let known = observed.len().min(outputs.len());
        outputs[..known].copy_from_slice(&observed[..known]);
    }

    #[test]
    fn inputs_move_from_the_window_on_and_not_under_the_observer_before_it() {
        let options = Options {
            observer_gain: 0.6,
            ..Options::default()
        };
        let episodes = [episode()];
        let windows = Windows::new(SHAPE, options.burn_in(), 4, &episodes);
        let basis = Basis::fit(&SHAPE, &windows.regressors());
        let device = Device::default().autodiff();
        let step = DVector::from_vec(vec![0.2, 0.3]);
        let frame = Frame::new(SHAPE, &basis, &step, 0.7, &options, &device);
        let batch = || frame.batch(&windows, &[3], 4, &device).inputs;
        let moves = tensor(1, 1, vec![0.5], &device);
        let moved = frame.batch(&windows, &[3], 4, &device).moved(&moves).inputs;
        let by: Vec<f64> = (moved.into_iter().zip(batch()))
            .map(|(after, before)| to_matrix(after - before)[(0, 0)])
            .collect();
        let (observed, ahead) = by.split_at(options.burn_in());
        assert!(!observed.is_empty() && observed.iter().all(|v| *v == 0.0));
        assert_eq!(ahead.len(), 4);
        assert!(ahead.iter().all(|v| (v - 0.5).abs() < 1e-6), "{ahead:?}");
    }

    #[test]
    fn what_was_trained_is_what_the_evaluator_computes() {
        for (first, observer_gain) in [
            (FirstLayer::Tanh, 1.0),
            (FirstLayer::Tanh, 0.6),
            (FirstLayer::Relu, 1.0),
            (FirstLayer::Gru, 1.0),
            (FirstLayer::Lstm, 1.0),
        ] {
            let (worst, said) = difference(first, observer_gain);
            assert!(said > 1e-2, "{first:?}: the network says nothing: {said:e}");
            assert!(worst < 2e-5, "{first:?}: {worst:e}");
        }
    }
}
