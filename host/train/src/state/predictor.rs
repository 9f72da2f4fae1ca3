//! The transition as burn sees it, and its training through its own predictions.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};
use burn_optim::{AdamConfig, GradientsParams, grad_clipping::GradientClippingConfig};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_ident::error::Error;

use super::model::{Scale, StateModel};
use super::rollouts::StateEpisode;
use crate::train::{Draws, Linear, least_squares, tensor, to_matrix};

/// Settings of the training.
#[derive(Clone, Debug, PartialEq)]
pub struct StateOptions {
    /// Hidden units.
    pub units: usize,
    /// Steps that the model predicts from its own predictions while it learns.
    pub rollout: usize,
    /// Passes; one pass is `batches` random batches.
    pub epochs: usize,
    /// Batches a pass.
    pub batches: usize,
    /// Windows a batch.
    pub batch: usize,
    /// Learning rate at the start; it falls to a hundredth along a cosine.
    pub learning_rate: f64,
    /// States whose sign matters, as a velocity's does to friction: half of the hidden units start
    /// as a step of one of them at its physical zero, each of another steepness.
    pub switching: Vec<usize>,
    /// Seed of everything that is drawn.
    pub seed: u64,
}

impl Default for StateOptions {
    fn default() -> Self {
        Self {
            units: 16,
            rollout: 10,
            epochs: 60,
            batches: 40,
            batch: 256,
            learning_rate: 2e-2,
            switching: Vec::new(),
            seed: 1,
        }
    }
}

/// Least and largest slope of a unit that starts as a step, model units.
const STEEPNESS: [f64; 2] = [10.0, 1000.0];

/// One pass: losses relative to the best linear model (1 = as good as that).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateEpoch {
    /// Mean over the pass's batches.
    pub training: f64,
    /// On episodes that train nothing.
    pub validation: f64,
}

/// x(k+1) = x + step * (linear(z) + gain * last(tanh(hidden(z)))), z = (x, u, theta) scaled (eq.
/// S1).
#[derive(Module, Debug)]
struct Transition {
    linear: Linear,
    hidden: Linear,
    last: Linear,
}

/// Constants of the training.
struct Frame {
    step: Tensor<2>,
    gain: f64,
    /// One over the linear model's error, each step, `[1][n]`.
    weights: Vec<Tensor<2>>,
}

/// Scaled episodes and the counts in them.
struct Data {
    n: usize,
    n_u: usize,
    p: usize,
    episodes: Vec<StateEpisode>,
}

impl Data {
    fn steps(&self) -> usize {
        self.episodes.first().map_or(0, |e| e.u.len() / self.n_u)
    }

    fn z(&self, episode: &StateEpisode, k: usize) -> Vec<f64> {
        [
            &episode.x[k * self.n..(k + 1) * self.n],
            &episode.u[k * self.n_u..(k + 1) * self.n_u],
            &episode.theta,
        ]
        .concat()
    }
}

/// Tensors of some windows: start, parameters, inputs and targets, one tensor a step.
struct Batch {
    x: Tensor<2>,
    theta: Tensor<2>,
    u: Vec<Tensor<2>>,
    targets: Vec<Tensor<2>>,
}

impl Batch {
    fn new(data: &Data, chosen: &[(usize, usize)], rollout: usize, device: &Device) -> Self {
        let rows = chosen.len();
        let part = |width: usize, offset: usize, values: &dyn Fn(&StateEpisode) -> Vec<f64>| {
            let all = chosen.iter().flat_map(|(episode, k)| {
                let start = (k + offset) * width;
                let values = values(&data.episodes[*episode]);
                values[start..start + width]
                    .iter()
                    .map(|v| *v as f32)
                    .collect::<Vec<_>>()
            });
            tensor(rows, width, all.collect(), device)
        };
        let theta = chosen.iter().flat_map(|(episode, _)| {
            let theta = &data.episodes[*episode].theta;
            theta.iter().map(|v| *v as f32).collect::<Vec<_>>()
        });
        Self {
            x: part(data.n, 0, &|e| e.x.clone()),
            theta: tensor(rows, data.p, theta.collect(), device),
            u: (0..rollout)
                .map(|j| part(data.n_u, j, &|e| e.u.clone()))
                .collect(),
            targets: (1..=rollout)
                .map(|j| part(data.n, j, &|e| e.x.clone()))
                .collect(),
        }
    }
}

impl Transition {
    fn roll_out(&self, step: &Tensor<2>, gain: f64, batch: &Batch) -> Vec<Tensor<2>> {
        let mut x = batch.x.clone();
        let mut predictions = Vec::with_capacity(batch.u.len());
        for u in &batch.u {
            let z = Tensor::cat(vec![x.clone(), u.clone(), batch.theta.clone()], 1);
            let network = self.last.forward(self.hidden.forward(z.clone()).tanh());
            let change = self.linear.forward(z) + network.mul_scalar(gain);
            x = x + change * step.clone();
            predictions.push(x.clone());
        }
        predictions
    }

    /// Mean square error over the rollout, each step in units of the linear model's (eq. S2).
    fn loss(&self, frame: &Frame, batch: &Batch) -> Tensor<1> {
        let predictions = self.roll_out(&frame.step, frame.gain, batch);
        let steps = predictions.len() as f64;
        let errors = predictions.into_iter().zip(&batch.targets);
        let total = errors
            .zip(&frame.weights)
            .map(|((x, target), weight)| {
                let e = (x - target.clone()) * weight.clone();
                (e.clone() * e).mean()
            })
            .reduce(|a, b| a + b);
        total.map_or_else(|| batch.x.clone().sum() * 0.0, |t| t.div_scalar(steps))
    }
}

/// Trains on `training`, keeps the pass that is best on `validation`, and scores the folded `f32`
/// weights once on `test` (docs/explanation/training.md, eq. S1 to S3).
///
/// `progress` is called after every pass with (passes done, passes in all, its losses).
///
/// # Errors
/// [`Error`] when a set is empty or shorter than the rollout, the data are not finite or the loss
/// never is.
pub fn train(
    (n_u, n_m): (usize, usize),
    [training, validation, test]: [&[StateEpisode]; 3],
    options: &StateOptions,
    mut progress: impl FnMut(usize, usize, StateEpoch),
) -> Result<StateModel, Error> {
    let scales = Scales::of(training, (n_u, n_m))?;
    let [training, validation, test] =
        [training, validation, test].map(|episodes| scales.apply(episodes));
    let rollout = options.rollout.max(1);
    for data in [&training, &validation, &test] {
        if data.steps() < rollout {
            return Err(Error::failed(format!(
                "episodes of {} periods hold no rollout of {rollout}; lengthen the episodes",
                data.steps()
            )));
        }
    }
    let (z, mut changes) = pairs(&training);
    if z.iter().chain(changes.iter()).any(|v| !v.is_finite()) {
        return Err(Error::failed("the simulated episodes are not finite"));
    }
    let n = training.n;
    let step = DVector::from_fn(n, |i, _| {
        let rms = changes.column(i).norm() / (changes.nrows() as f64).sqrt();
        if rms > 0.0 { rms } else { 1.0 }
    });
    for i in 0..n {
        changes.column_mut(i).unscale_mut(step[i]);
    }
    let (w, b) = least_squares(&z, &changes);
    let unexplained = (&changes - &z * w.transpose()).norm() / (changes.len() as f64).sqrt();
    let gain = unexplained.max(1e-4);

    let device = Device::default().autodiff();
    let mut model = Transition {
        linear: filled(&w, &b, &device),
        hidden: started(z.ncols(), options, &scales.states, &device),
        last: filled(
            &DMatrix::zeros(n, options.units),
            &DVector::zeros(n),
            &device,
        ),
    };
    let step_row = tensor(1, n, step.iter().map(|v| *v as f32).collect(), &device);
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let sample = |data: &Data, count: usize, random: &mut ChaCha8Rng| -> Vec<(usize, usize)> {
        let last = data.steps() - rollout;
        (0..count)
            .map(|_| {
                let episode = random.random_range(0..data.episodes.len());
                (episode, random.random_range(0..=last))
            })
            .collect()
    };
    let reference = sample(&training, 4096, &mut random);
    let reference = Batch::new(&training, &reference, rollout, &device);
    let weights = loss_weights(&model, (&step_row, gain), &reference, &device);
    let frame = Frame {
        weights,
        step: step_row,
        gain,
    };
    let judged = sample(&validation, 4096, &mut random);
    let judged = Batch::new(&validation, &judged, rollout, &device);

    let mut optimizer = AdamConfig::new()
        .with_grad_clipping(Some(GradientClippingConfig::Norm(1.0)))
        .init();
    let mut best = (f64::INFINITY, model.clone());
    let total = (options.epochs * options.batches) as f64;
    for epoch in 0..options.epochs {
        let mut sum = 0.0;
        for batch in 0..options.batches {
            let done = (epoch * options.batches + batch) as f64 / total;
            let rate = options.learning_rate
                * (0.01 + 0.99 * 0.5 * (1.0 + (std::f64::consts::PI * done).cos()));
            let chosen = sample(&training, options.batch, &mut random);
            let data = Batch::new(&training, &chosen, rollout, &device);
            let loss = model.loss(&frame, &data);
            sum += f64::from(loss.clone().into_scalar::<f32>());
            let gradients = GradientsParams::from_grads(loss.backward(), &model);
            model = optimizer.step(rate, model, gradients);
        }
        let losses = StateEpoch {
            training: sum / options.batches as f64,
            validation: f64::from(model.loss(&frame, &judged).into_scalar::<f32>()),
        };
        if losses.validation < best.0 {
            best = (losses.validation, model.clone());
        }
        progress(epoch + 1, options.epochs, losses);
    }
    if !best.0.is_finite() {
        return Err(Error::failed("the loss never became finite").help("lower the learning rate"));
    }
    let mut model = fold(&best.1, &step, gain, scales);
    measure(&mut model, &training);
    measure_one_step(&mut model, &test);
    Ok(model)
}

/// Weights of the loss: one over the errors of the linear model, at each step of the rollout.
fn loss_weights(
    model: &Transition,
    (step, gain): (&Tensor<2>, f64),
    reference: &Batch,
    device: &Device,
) -> Vec<Tensor<2>> {
    let predictions = model.roll_out(step, gain, reference);
    let errors = predictions.into_iter().zip(&reference.targets);
    let weights = errors.map(|(x, target)| {
        let e = x - target.clone();
        let squares = to_matrix((e.clone() * e).mean_dim(0));
        let weights = squares.iter().map(|v| (1.0 / v.sqrt().max(1e-6)) as f32);
        tensor(1, step.dims()[1], weights.collect(), device)
    });
    weights.collect()
}

/// Root mean square error of each state one step ahead.
fn measure_one_step(model: &mut StateModel, test: &Data) {
    let n = test.n;
    let (z, changes) = pairs(test);
    model.one_step_error = vec![0.0; n];
    for (z, change) in z.row_iter().zip(changes.row_iter()) {
        let z: Vec<f64> = z.iter().copied().collect();
        let next = model.next(&z);
        for i in 0..n {
            let error = next[i] - z[i] - change[i];
            model.one_step_error[i] += error * error / changes.nrows() as f64;
        }
    }
    for error in &mut model.one_step_error {
        *error = error.sqrt();
    }
}

/// The hidden layer before training. A gradient moves weights of order 1, and a step as sharp as
/// dry friction's has weights of order 100: it is not found from there.
fn started(inputs: usize, options: &StateOptions, states: &[Scale], device: &Device) -> Linear {
    let drawn = Linear::drawn(inputs, options.units, &mut Draws::new(options.seed, device));
    let steps = match options.switching.len() {
        0 => 0,
        _ => options.units / 2,
    };
    if steps == 0 {
        return drawn;
    }
    let mut w = to_matrix(drawn.weight.val()).transpose();
    let bias = drawn.bias.as_ref().map(|b| b.val().into_data());
    let mut b = bias.map_or_else(
        || DVector::zeros(options.units),
        |b| DVector::from_iterator(options.units, b.iter::<f64>()),
    );
    let [least, most] = STEEPNESS;
    for unit in 0..steps {
        let state = options.switching[unit % options.switching.len()];
        let share = unit as f64 / (steps.max(2) - 1) as f64;
        let steepness = least * (most / least).powf(share);
        let Some(scale) = states.get(state) else {
            continue;
        };
        w.row_mut(unit).fill(0.0);
        w[(unit, state)] = steepness;
        b[unit] = steepness * scale.offset / scale.span;
    }
    filled(&w, &b, device)
}

/// Every z(k) and x(k+1) - x(k), a row each.
fn pairs(data: &Data) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = data.n;
    let steps = data.steps();
    let rows = data.episodes.len() * steps;
    let columns = n + data.n_u + data.p;
    let (mut z, mut changes) = (DMatrix::zeros(rows, columns), DMatrix::zeros(rows, n));
    for (e, episode) in data.episodes.iter().enumerate() {
        for k in 0..steps {
            let row = e * steps + k;
            for (column, value) in data.z(episode, k).into_iter().enumerate() {
                z[(row, column)] = value;
            }
            for i in 0..n {
                changes[(row, i)] = episode.x[(k + 1) * n + i] - episode.x[k * n + i];
            }
        }
    }
    (z, changes)
}

/// A layer with these weights, `[outputs][inputs]`.
fn filled(w: &DMatrix<f64>, b: &DVector<f64>, device: &Device) -> Linear {
    let transposed = w.transpose();
    let values = transposed.row_iter();
    let values = values.flat_map(|row| row.iter().map(|v| *v as f32).collect::<Vec<_>>());
    let weight = tensor(w.ncols(), w.nrows(), values.collect(), device);
    let bias: Vec<f32> = b.iter().map(|v| *v as f32).collect();
    let bias = Tensor::<1>::from_data(TensorData::new(bias, [b.len()]), device);
    Linear {
        weight: Param::from_tensor(weight),
        bias: Some(Param::from_tensor(bias)),
    }
}

/// Scales of all signals, from the training data alone.
struct Scales {
    states: Vec<Scale>,
    inputs: Vec<Scale>,
    measurements: Vec<Scale>,
}

impl Scales {
    fn of(training: &[StateEpisode], (n_u, n_m): (usize, usize)) -> Result<Self, Error> {
        let Some(first) = training.first() else {
            return Err(Error::failed("no episode to train on"));
        };
        let steps = first.u.len() / n_u.max(1);
        let n = first.x.len() / (steps + 1);
        let scales = |width: usize, values: fn(&StateEpisode) -> &[f64]| -> Vec<Scale> {
            let column = |i: usize| {
                let all = training.iter().flat_map(|e| values(e).iter());
                Scale::of(all.skip(i).step_by(width).copied())
            };
            (0..width).map(column).collect()
        };
        Ok(Self {
            states: scales(n, |e| &e.x),
            inputs: scales(n_u, |e| &e.u),
            measurements: scales(n_m, |e| &e.m),
        })
    }

    fn apply(&self, episodes: &[StateEpisode]) -> Data {
        let scaled = |scales: &[Scale], values: &[f64]| -> Vec<f64> {
            let pairs = values.iter().zip(scales.iter().cycle());
            pairs.map(|(value, scale)| scale.scaled(*value)).collect()
        };
        Data {
            n: self.states.len(),
            n_u: self.inputs.len(),
            p: episodes.first().map_or(0, |e| e.theta.len()),
            episodes: episodes
                .iter()
                .map(|e| StateEpisode {
                    theta: e.theta.clone(),
                    u: scaled(&self.inputs, &e.u),
                    x: scaled(&self.states, &e.x),
                    m: scaled(&self.measurements, &e.m),
                })
                .collect(),
        }
    }
}

/// Weights with step and gain in them (eq. S1 to docs/explanation/controller.md, eq. 20).
fn fold(model: &Transition, step: &DVector<f64>, gain: f64, scales: Scales) -> StateModel {
    let rows = |m: &DMatrix<f64>| -> Vec<Vec<f32>> {
        let rows = m.row_iter();
        rows.map(|row| row.iter().map(|v| *v as f32).collect())
            .collect()
    };
    let parts = |layer: &Linear| {
        let w = to_matrix(layer.weight.val()).transpose();
        let b: Vec<f64> = layer.bias.as_ref().map_or_else(
            || vec![0.0; w.nrows()],
            |b| b.val().into_data().iter::<f64>().collect(),
        );
        (w, DVector::from_vec(b))
    };
    let by_step = DMatrix::from_diagonal(step);
    let (linear, bias) = parts(&model.linear);
    let (hidden, hidden_bias) = parts(&model.hidden);
    let (last, last_bias) = parts(&model.last);
    let bias = &by_step * (bias + last_bias * gain);
    StateModel {
        states: scales.states,
        inputs: scales.inputs,
        measurements: scales.measurements,
        linear: rows(&(&by_step * linear)),
        bias: bias.iter().map(|v| *v as f32).collect(),
        hidden: rows(&hidden),
        hidden_bias: hidden_bias.iter().map(|v| *v as f32).collect(),
        output: rows(&(&by_step * last * gain)),
        measurement: Vec::new(),
        measurement_bias: Vec::new(),
        measurement_error: Vec::new(),
        one_step_error: Vec::new(),
    }
}

/// The measurements as a linear function of the state, by least squares (eq. S3).
fn measure(model: &mut StateModel, data: &Data) {
    let (n, n_m) = (data.n, model.measurements.len());
    let rows = data.episodes.iter().flat_map(|e| e.x.chunks_exact(n));
    let x: Vec<f64> = rows.flatten().copied().collect();
    let m: Vec<f64> = data.episodes.iter().flat_map(|e| e.m.clone()).collect();
    let x = DMatrix::from_row_slice(x.len() / n, n, &x);
    let m = DMatrix::from_row_slice(x.nrows(), n_m, &m);
    let (c, offset) = least_squares(&x, &m);
    let mut left = &m - &x * c.transpose();
    for (i, b) in offset.iter().enumerate() {
        left.column_mut(i).add_scalar_mut(-b);
    }
    let count = (x.nrows() as f64).sqrt();
    model.measurement_error = left.column_iter().map(|c| c.norm() / count).collect();
    model.measurement = c
        .row_iter()
        .map(|row| row.iter().map(|v| *v as f32).collect())
        .collect();
    model.measurement_bias = offset.iter().map(|v| *v as f32).collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of the units switch where the physical state passes zero, from gently to sharply.
    #[test]
    fn half_of_the_units_start_as_steps_at_the_physical_zero() {
        let scale = |span, offset| Scale { span, offset };
        let states = [scale(1.0, 0.0), scale(2.0, 0.5)];
        let options = StateOptions {
            units: 6,
            switching: vec![1],
            ..StateOptions::default()
        };
        let device = Device::default().autodiff();
        let layer = started(4, &options, &states, &device);
        let weights = to_matrix(layer.weight.val());
        let bias = layer
            .bias
            .as_ref()
            .expect("the layer has a bias")
            .val()
            .into_data();
        let bias: Vec<f64> = bias.iter::<f64>().collect();
        let at_rest = states[1].scaled(0.0);
        for (column, bias) in weights.column_iter().zip(&bias).take(3) {
            assert_eq!([column[0], column[2], column[3]], [0.0; 3]);
            assert!((column[1] * at_rest + bias).abs() < 1e-3, "{column}");
        }
        let slopes = [0, 1, 2].map(|unit| weights[(1, unit)]);
        for (slope, expected) in slopes.iter().zip([10.0, 100.0, 1000.0]) {
            assert!((slope / expected - 1.0).abs() < 1e-4, "{slopes:?}");
        }
        assert!(weights.column(3).iter().all(|weight| weight.abs() < 5.0));
    }
}
