//! A dense layer as burn's own has it: `burn-nn`, which holds that and fifty others, takes as long
//! to compile as all of this crate.

use burn::module::{Module, Param};
use burn::tensor::module::linear;
use burn::tensor::{Device, Tensor, TensorData};
use rand::SeedableRng;
use rand::distr::{Distribution, Uniform};
use rand_chacha::ChaCha12Rng;

/// `x W + b`.
#[derive(Module, Debug)]
pub struct Linear {
    /// W, `[inputs][outputs]`.
    pub weight: Param<Tensor<2>>,
    /// b, `[outputs]`.
    pub bias: Option<Param<Tensor<1>>>,
}

impl Linear {
    /// A layer whose weights are drawn from `U(-k, k)`, `k = sqrt(1 / inputs)`.
    pub fn drawn(inputs: usize, outputs: usize, draws: &mut Draws) -> Self {
        let without_bias = Self::without_bias(inputs, outputs, draws);
        Self {
            bias: Some(draws.parameter([outputs], inputs)),
            ..without_bias
        }
    }

    /// The same without b.
    pub fn without_bias(inputs: usize, outputs: usize, draws: &mut Draws) -> Self {
        Self {
            weight: draws.parameter([inputs, outputs], inputs),
            bias: None,
        }
    }

    /// The output for each row of the input.
    pub fn forward<const D: usize>(&self, input: Tensor<D>) -> Tensor<D> {
        linear(input, self.weight.val(), self.bias.as_ref().map(Param::val))
    }
}

/// The weights that one training starts from. burn's own generator belongs to the whole process:
/// with that, two trainings side by side, or two tests, would draw each other's weights.
pub struct Draws {
    generator: ChaCha12Rng,
    device: Device,
}

impl Draws {
    /// Draws that follow from `seed` alone.
    pub fn new(seed: u64, device: &Device) -> Self {
        Self {
            generator: ChaCha12Rng::seed_from_u64(seed),
            device: device.clone(),
        }
    }

    fn parameter<const D: usize>(&mut self, shape: [usize; D], inputs: usize) -> Param<Tensor<D>> {
        // Kaiming's uniform initialisation with the gain 1 / sqrt(3), rounded as burn rounds it.
        let root = 3.0_f64.sqrt();
        let bound = (root * (1.0 / root) * (1.0 / (inputs as f64).sqrt())) as f32;
        let length = shape.iter().product();
        let values: Vec<f32> = match Uniform::new(-bound, bound) {
            Ok(range) => range
                .sample_iter(&mut self.generator)
                .take(length)
                .collect(),
            // A layer without inputs has no bound, and nothing to multiply either.
            Err(_) => vec![0.0; length],
        };
        Param::from_tensor(Tensor::from_data(
            TensorData::new(values, shape),
            &self.device,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_of_one_training_are_not_moved_by_another() {
        let device = Device::default();
        let values = |layer: &Linear| layer.weight.val().into_data();
        let alone = Linear::drawn(3, 4, &mut Draws::new(7, &device));
        let mut draws = Draws::new(7, &device);
        let mut others = Draws::new(7, &device);
        device.seed(1);
        let _ = Linear::drawn(5, 2, &mut others);
        let beside = Linear::drawn(3, 4, &mut draws);
        assert_eq!(values(&alone), values(&beside));
        let bound = (1.0_f64 / 3.0).sqrt() as f32;
        assert!(values(&alone).iter::<f32>().all(|v| v.abs() <= bound));
    }
}
