//! A dense layer as burn's own has it: `burn-nn`, which holds that and fifty others, takes as long
//! to compile as all of this crate.

use burn::module::{Module, Param, ParamId};
use burn::tensor::module::linear;
use burn::tensor::{Device, Distribution, Tensor};

/// `x W + b`.
#[derive(Module, Debug)]
pub struct Linear {
    /// W, `[inputs][outputs]`.
    pub weight: Param<Tensor<2>>,
    /// b, `[outputs]`.
    pub bias: Option<Param<Tensor<1>>>,
}

impl Linear {
    /// A layer whose weights are drawn from `U(-k, k)`, `k = sqrt(1 / inputs)`, when they are first
    /// used.
    pub fn drawn(inputs: usize, outputs: usize, device: &Device) -> Self {
        Self {
            bias: Some(drawn([outputs], inputs, device)),
            ..Self::without_bias(inputs, outputs, device)
        }
    }

    /// The same without b.
    pub fn without_bias(inputs: usize, outputs: usize, device: &Device) -> Self {
        Self {
            weight: drawn([inputs, outputs], inputs, device),
            bias: None,
        }
    }

    /// The output for each row of the input.
    pub fn forward<const D: usize>(&self, input: Tensor<D>) -> Tensor<D> {
        linear(input, self.weight.val(), self.bias.as_ref().map(Param::val))
    }
}

fn drawn<const D: usize>(shape: [usize; D], inputs: usize, device: &Device) -> Param<Tensor<D>> {
    // Kaiming's uniform initialisation with the gain 1 / sqrt(3), rounded as burn rounds it.
    let root = 3.0_f64.sqrt();
    let bound = root * (1.0 / root) * (1.0 / (inputs as f64).sqrt());
    let draw = move |device: &Device, learned: bool| {
        let values = Tensor::random(shape, Distribution::Uniform(-bound, bound), device);
        if learned {
            values.require_grad()
        } else {
            values
        }
    };
    Param::uninitialized(ParamId::new(), draw, device.clone(), true, shape.into())
}
