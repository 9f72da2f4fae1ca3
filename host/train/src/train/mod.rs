//! Training: episodes in, a model specification with its scaling out
//! (docs/explanation/training.md).
//!
//! Episodes for training, for choosing when to stop and for the final score are disjoint; the score
//! is taken once, from the folded `f32` weights that the firmware will carry.

mod basis;
mod batch;
mod cell;
mod checkpoint;
mod fold;
mod layers;
mod linear;
mod matrix;
mod network;
mod sensitivities;
mod windows;

use crate::network_table::FirstLayer;
use burn::tensor::Device;
use burn_optim::{AdamConfig, GradientsParams, grad_clipping::GradientClippingConfig};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use checkpoint::Checkpoint;
pub use fold::{Folded, Remembering};
pub use layers::layers;
pub use windows::{Scaled, Shape, Windows, scale, scaling};

pub(crate) use basis::least_squares;
pub(crate) use linear::{Draws, Linear};
pub(crate) use matrix::{tensor, to_matrix};

use basis::Basis;
use batch::Frame;
use checkpoint::Reached;
use network::{Predictor, loss_weights};
use sensitivities::Sensitivities;
use sinew_ident::error::Error;

/// Gates of a first layer that remembers.
pub fn gates(first: FirstLayer) -> Option<usize> {
    match first {
        FirstLayer::Tanh | FirstLayer::Relu => None,
        FirstLayer::Gru => Some(3),
        FirstLayer::Lstm => Some(4),
    }
}

/// Steps before a window from which a network that remembers gets its state.
pub const BURN_IN: usize = 32;

/// Steps until an observer has forgotten all but a thousandth of what it began with.
fn observer_steps(gain: f64) -> usize {
    const MOST: f64 = 32.0;
    if gain < 1.0 {
        (1e-3_f64.ln() / (1.0 - gain).ln()).ceil().min(MOST) as usize
    } else {
        0
    }
}

/// Settings of the training.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Kind of the first layer.
    pub first: FirstLayer,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Part of a measurement that enters the past that the network sees, over 0 to 1, as in the
    /// firmware (docs/explanation/controller.md, eq. 10c).
    pub observer_gain: f64,
    /// Weight of the simulator's derivatives in the loss, beside 1 for the errors; 0 for none.
    pub derivative_weight: f64,
    /// Steps that the network predicts from its own predictions while it learns.
    pub rollout: usize,
    /// Passes; one pass is `batches` random batches.
    pub epochs: usize,
    /// Batches a pass.
    pub batches: usize,
    /// Windows a batch.
    pub batch: usize,
    /// Learning rate at the start; it falls to a hundredth along a cosine.
    pub learning_rate: f64,
    /// Seed of everything that is drawn.
    pub seed: u64,
}

impl Options {
    /// Settings that suit a network that begins so. One that remembers takes longer a pass, and
    /// settles at a lower rate.
    pub fn of(first: FirstLayer) -> Self {
        let usual = Self {
            first,
            ..Self::default()
        };
        match gates(first) {
            None => usual,
            Some(_) => Self {
                epochs: 60,
                batch: 128,
                learning_rate: 5e-3,
                ..usual
            },
        }
    }

    /// Steps of burn-in: none for a network that remembers nothing and has no observer before it.
    pub fn burn_in(&self) -> usize {
        gates(self.first).map_or_else(|| observer_steps(self.observer_gain), |_| BURN_IN)
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            first: FirstLayer::Tanh,
            hidden: vec![12],
            observer_gain: 1.0,
            derivative_weight: 0.0,
            rollout: 10,
            epochs: 100,
            batches: 40,
            batch: 256,
            learning_rate: 2e-2,
            seed: 1,
        }
    }
}

/// One pass of training: losses relative to the best linear predictor (1 = as good as that).
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct Epoch {
    /// Mean loss over the pass's batches.
    pub training: f64,
    /// Loss on episodes that train nothing.
    pub validation: f64,
}

/// A trained predictor with the record of its training.
pub struct Trained {
    /// Weights on the raw regressor, model units.
    pub folded: Folded,
    /// One entry a pass.
    pub history: Vec<Epoch>,
    /// The pass whose weights were kept.
    pub kept: usize,
}

/// Trains on `training`, keeps the pass that is best on `validation`.
///
/// `progress` is called after every pass with (passes done, passes in all, its losses). A training
/// that was stopped goes on from its `checkpoint`, and ends with the same weights.
///
/// # Errors
/// [`Error`] when the checkpoint cannot be written, an episode set has no window of the asked
/// rollout or the data are not finite.
pub fn train(
    shape: Shape,
    training: &[Scaled],
    validation: &[Scaled],
    options: &Options,
    mut checkpoint: Option<&mut Checkpoint>,
    mut progress: impl FnMut(usize, usize, Epoch),
) -> Result<Trained, Error> {
    let burn_in = options.burn_in();
    let windows = Windows::new(shape, burn_in, options.rollout.max(1), training);
    let judged = Windows::new(shape, burn_in, options.rollout.max(1), validation);
    if windows.is_empty() || judged.is_empty() {
        return Err(Error::failed(format!(
            "no stretch of {} samples in the {} episodes; shorten the rollout or lengthen the episodes",
            shape.history() + burn_in + 1 + options.rollout,
            if windows.is_empty() {
                "training"
            } else {
                "validation"
            },
        )));
    }

    let x = windows.regressors();
    if x.iter().any(|v| !v.is_finite()) {
        return Err(Error::failed("the simulated episodes are not finite"));
    }
    let basis = Basis::fit(&shape, &x);
    let (step, changes) = typical_change(&windows, &x, shape);
    let z = basis.features(&x);
    let (w, b) = least_squares(&z, &changes);
    let unexplained = (&changes - &z * w.transpose()).norm() / (changes.len() as f64).sqrt();

    let device = Device::default().autodiff();
    let gain = unexplained.max(1e-4);
    let frame = Frame::new(shape, &basis, &step, gain, options, &device);
    let predictor = Predictor::new(
        (options.first, &options.hidden),
        &w,
        &b,
        &mut Draws::new(options.seed, &device),
        &device,
    );

    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let sample = |windows: &Windows<'_>, count: usize, random: &mut ChaCha8Rng| -> Vec<usize> {
        (0..count)
            .map(|_| random.random_range(0..windows.len()))
            .collect()
    };
    let rollout = options.rollout.max(1);
    let reference = frame.batch(
        &windows,
        &sample(&windows, 4096, &mut random),
        rollout,
        &device,
    );
    let sizes = predictor.step_errors(&frame, &reference);
    let floored: Vec<Vec<f64>> = sizes
        .iter()
        .map(|s| s.iter().map(|v| v.max(1e-6)).collect())
        .collect();
    let weights = loss_weights(&floored, &device);
    // Of a network that remembers each takes several times as long.
    let judges = if burn_in > 0 { 1024 } else { 4096 };
    let judge = frame.batch(
        &judged,
        &sample(&judged, judges, &mut random),
        rollout,
        &device,
    );

    let optimizer = AdamConfig::new()
        .with_grad_clipping(Some(GradientClippingConfig::Norm(1.0)))
        .init();
    let key = checkpoint::key(options, [&x, &judged.regressors()]);
    let start = Reached {
        best: (f64::INFINITY, 0, predictor.clone()),
        predictor,
        optimizer,
        history: Vec::with_capacity(options.epochs),
    };
    let mut at = match &checkpoint {
        Some(checkpoint) => checkpoint.reached(key, start),
        None => start,
    };
    let weight = options.derivative_weight;
    let sensitivities = if weight > 0.0 {
        Some([&windows, &judged].map(|windows| Sensitivities::of(windows, rollout, shape.n_y)))
    } else {
        None
    };
    let sensitivities = match sensitivities {
        None => None,
        Some([Some(taught), Some(judged)]) => Some((taught, judged)),
        Some(_) => return Err(Error::failed(
            "in the simulated episodes no input moves any output by a finite number, or all stand at their limits",
        )
        .help("correct the rig, or leave `derivative_weight` of [network] out")),
    };
    let sensitivities_of = |sensitivities: &Sensitivities<'_>, random: &mut ChaCha8Rng| {
        sensitivities.sample((options.batch / 2).max(1), random)
    };
    let judging = sensitivities
        .as_ref()
        .map(|(_, judged)| judged.first(judges));
    // The batches that were taken, so that those to come are the same.
    for _ in 0..at.history.len() * options.batches {
        sample(&windows, options.batch, &mut random);
        if let Some((taught, _)) = &sensitivities {
            sensitivities_of(taught, &mut random);
        }
    }
    let total = (options.epochs * options.batches) as f64;
    for epoch in at.history.len()..options.epochs {
        let mut sum = 0.0;
        for batch in 0..options.batches {
            let done = (epoch * options.batches + batch) as f64 / total;
            let rate = options.learning_rate
                * (0.01 + 0.99 * 0.5 * (1.0 + (std::f64::consts::PI * done).cos()));
            let chosen = sample(&windows, options.batch, &mut random);
            let data = frame.batch(&windows, &chosen, rollout, &device);
            let mut loss = at.predictor.loss(&frame, &data, &weights);
            if let Some((taught, _)) = &sensitivities {
                let chosen = sensitivities_of(taught, &mut random);
                let of_slopes = taught.loss(&at.predictor, &frame, &chosen, &device);
                loss = loss + of_slopes.mul_scalar(weight);
            }
            sum += f64::from(loss.clone().into_scalar::<f32>());
            let gradients = GradientsParams::from_grads(loss.backward(), &at.predictor);
            at.predictor = at.optimizer.step(rate, at.predictor, gradients);
        }
        let mut loss = at.predictor.loss(&frame, &judge, &weights);
        if let (Some((_, judged)), Some(chosen)) = (&sensitivities, &judging) {
            let of_slopes = judged.loss(&at.predictor, &frame, chosen, &device);
            loss = loss + of_slopes.mul_scalar(weight);
        }
        let validation = f64::from(loss.into_scalar::<f32>());
        let losses = Epoch {
            training: sum / options.batches as f64,
            validation,
        };
        at.history.push(losses);
        if validation < at.best.0 {
            at.best = (validation, epoch, at.predictor.clone());
        }
        if let Some(checkpoint) = &mut checkpoint {
            checkpoint.save(key, &at)?;
        }
        progress(epoch + 1, options.epochs, losses);
    }
    if let Some(checkpoint) = &checkpoint {
        checkpoint.done();
    }
    if !at.best.0.is_finite() {
        return Err(Error::failed("the loss never became finite").help("lower the learning rate"));
    }
    let folded = Folded::new(&basis, (&step, gain), &at.best.2, options.first, shape);
    Ok(Trained {
        folded,
        history: at.history,
        kept: at.best.1,
    })
}

/// Root mean square change of each output in one period, and every change divided by it.
fn typical_change(
    windows: &Windows<'_>,
    x: &DMatrix<f64>,
    shape: Shape,
) -> (DVector<f64>, DMatrix<f64>) {
    let newest = shape.n_u * shape.past_inputs;
    let mut changes = DMatrix::from_fn(windows.len(), shape.n_y, |w, r| {
        windows.targets(w)[r] - x[(w, newest + r)]
    });
    let step = DVector::from_fn(shape.n_y, |r, _| {
        let rms = changes.column(r).norm() / (windows.len() as f64).sqrt();
        if rms > 0.0 { rms } else { 1.0 }
    });
    for r in 0..shape.n_y {
        changes.column_mut(r).unscale_mut(step[r]);
    }
    (step, changes)
}
