//! The simulator's derivatives in the loss: not only where a network says that the outputs go, but
//! how they answer to the inputs (docs/explanation/training.md, eq. T3c). A controller descends on
//! the latter.

use burn::tensor::{Device, Tensor};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::batch::Frame;
use super::matrix::tensor;
use super::network::Predictor;
use super::windows::Windows;
use crate::dataset::Sensitivity;

/// Half the difference that the network's sensitivity is taken over, in reaches of the inputs:
/// small beside the bend of a tanh, large beside the rounding of `f32`.
const HALF_STEP: f32 = 1.0 / 16.0;

/// Least size that a sensitivity is measured by, as a part of what sensitivities have at the end of
/// the rollout: at first, and in a delay, there is next to none.
const FLOOR: f64 = 0.2;

/// The sensitivities that training windows have.
pub struct Sensitivities<'a> {
    windows: &'a Windows<'a>,
    places: Vec<(usize, &'a Sensitivity)>,
    rollout: usize,
    /// Weight of an error at each step.
    sizes: Vec<f32>,
}

impl<'a> Sensitivities<'a> {
    /// Those of `windows`; `None` where there are none, or inputs change nothing.
    pub fn of(windows: &'a Windows<'a>, rollout: usize, n_y: usize) -> Option<Self> {
        let places = windows.sensitivities(rollout * n_y);
        let sizes: Vec<f64> = (0..rollout)
            .map(|j| {
                let at = places
                    .iter()
                    .flat_map(|(_, s)| &s.of[j * n_y..(j + 1) * n_y]);
                (at.map(|v| v * v).sum::<f64>() / (places.len() * n_y) as f64).sqrt()
            })
            .collect();
        let least = FLOOR * sizes.last()?;
        (least > 0.0 && least.is_finite()).then(|| Self {
            windows,
            places,
            rollout,
            sizes: sizes.iter().map(|s| s.max(least) as f32).collect(),
        })
    }

    /// `count` of them, drawn.
    pub fn sample(&self, count: usize, random: &mut ChaCha8Rng) -> Vec<usize> {
        let each = (0..count).map(|_| random.random_range(0..self.places.len()));
        each.collect()
    }

    /// The first ones, at most `count`.
    pub fn first(&self, count: usize) -> Vec<usize> {
        (0..self.places.len().min(count)).collect()
    }

    /// Mean over the rollout of the squared errors of the predictor's sensitivities, those of step
    /// j in units of their size there: 1 is as good as to say that inputs change nothing.
    pub fn loss(
        &self,
        predictor: &Predictor,
        frame: &Frame,
        chosen: &[usize],
        device: &Device,
    ) -> Tensor<1> {
        let (n_u, n_y) = (frame.shape.n_u, frame.shape.n_y);
        let places: Vec<_> = chosen.iter().map(|c| self.places[*c]).collect();
        // Both sides of the difference at once: the same windows twice.
        let windows: Vec<usize> = places.iter().chain(&places).map(|(w, _)| *w).collect();
        let along = places.iter().flat_map(|(_, s)| &s.along);
        let along = along.map(|v| HALF_STEP * *v as f32).collect();
        let ahead = tensor(places.len(), n_u, along, device);
        let moves = Tensor::cat(vec![ahead.clone(), -ahead], 0);
        let batch = frame.batch(self.windows, &windows, self.rollout, device);
        let predictions = predictor.roll_out(frame, &batch.moved(&moves));

        let mut total = Tensor::<1>::zeros([1], device);
        for (j, (y, size)) in predictions.into_iter().zip(&self.sizes).enumerate() {
            let [ahead, behind] = [0, places.len()].map(|at| y.clone().narrow(0, at, places.len()));
            let exact = places
                .iter()
                .flat_map(|(_, s)| &s.of[j * n_y..(j + 1) * n_y]);
            let exact = exact.map(|v| *v as f32).collect();
            let exact = tensor(places.len(), n_y, exact, device);
            let found = (ahead - behind).div_scalar(2.0 * HALF_STEP);
            let e = (found - exact).div_scalar(*size);
            total = total + (e.clone() * e).mean();
        }
        total.div_scalar(self.rollout as f32)
    }
}

#[cfg(test)]
mod tests {
    use crate::network_table::FirstLayer;
    use rand::SeedableRng;
    use sinew_model::evaluate::advance;

    use super::*;
    use crate::train::{Options, Scaled, Shape, train};

    const SHAPE: Shape = Shape {
        n_u: 2,
        n_y: 1,
        past_inputs: 1,
        past_outputs: 1,
        n_s: 0,
    };
    const ROLLOUT: usize = 3;

    /// y(k+1) = 0.8 y(k) + 0.3 sin(2 u_1(k)); u_2 does nothing, but all that is known of it is that
    /// it moves with u_1.
    fn episode(seed: u64) -> Scaled {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (mut u, mut y, mut sensitivities) = (vec![], vec![0.0], vec![]);
        let levels: Vec<f64> = (0..63).map(|_| random.random_range(-1.0..1.0)).collect();
        for (k, level) in levels[..60].iter().enumerate() {
            u.extend([*level; 2]);
            y.push(0.8 * y[k] + 0.3 * (2.0 * level).sin());
            let along: Vec<f64> = (0..2).map(|_| random.random_range(-1.0..1.0)).collect();
            let mut sensitivity = 0.0;
            let of = levels[k..k + ROLLOUT].iter().map(|level| {
                sensitivity = 0.8 * sensitivity + 0.6 * (2.0 * level).cos() * along[0];
                sensitivity
            });
            let of = of.collect();
            sensitivities.push(Sensitivity { from: k, along, of });
        }
        Scaled {
            u,
            measured: y.clone(),
            y,
            channels: vec![],
            sensitivities,
            steps: 60,
        }
    }

    /// Answer of the next output to each input, where a network was trained with this weight of
    /// the derivatives.
    fn answers(first: FirstLayer, derivative_weight: f64) -> [f64; 2] {
        let options = Options {
            first,
            derivative_weight,
            hidden: vec![8],
            rollout: ROLLOUT,
            epochs: 30,
            batches: 10,
            batch: 32,
            ..Options::default()
        };
        let training = [episode(1), episode(2), episode(3)];
        let trained = train(
            SHAPE,
            &training,
            &[episode(4)],
            &options,
            None,
            |_, _, _| {},
        );
        let spec = crate::train::network::tests::spec(
            &trained.expect("the training converges").folded,
            SHAPE,
        );
        let memory = vec![0.0; spec.hidden_state_len()];
        let at = |u: [f64; 2]| advance(&spec, &[&u[..], &[0.0], &memory].concat()).0[0];
        [
            (at([0.1, 0.0]) - at([-0.1, 0.0])) / 0.2,
            (at([0.0, 0.1]) - at([0.0, -0.1])) / 0.2,
        ]
    }

    #[test]
    fn inputs_that_move_nothing_are_not_learned_from_in_silence() {
        let mut still = episode(1);
        still
            .sensitivities
            .iter_mut()
            .for_each(|sensitivity| sensitivity.of.fill(0.0));
        let none = Scaled {
            sensitivities: vec![],
            ..episode(1)
        };
        for training in [still, none] {
            let options = Options {
                derivative_weight: 1.0,
                rollout: ROLLOUT,
                ..Options::default()
            };
            let judged = [episode(2)];
            let refused = train(SHAPE, &[training], &judged, &options, None, |_, _, _| {});
            let said = refused.err().map(|e| e.to_string()).unwrap_or_default();
            assert!(said.contains("no input moves any output"), "{said}");
        }
    }

    #[test]
    fn derivatives_tell_apart_what_always_moved_together() {
        let off = |[one, two]: [f64; 2]| (one - 0.6).abs().max(two.abs());
        let without = off(answers(FirstLayer::Tanh, 0.0));
        assert!(without > 0.2, "{without}");
        for first in [FirstLayer::Tanh, FirstLayer::Gru] {
            let with = off(answers(first, 1.0));
            assert!(with < 0.15, "{first:?}: {with}");
        }
    }
}
