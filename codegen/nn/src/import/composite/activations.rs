//! Activations without a kernel of their own.

use crate::{Activation, Network, NetworkError, Op};

impl Network {
    /// `ln sigmoid(x) = -softplus(-x)`.
    pub(in crate::import) fn log_sigmoid(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let negative = self.scaled(name, x, -1.0, 0.0)?;
        let softplus = self.apply(name, Activation::Softplus, negative)?;
        self.scaled(name, softplus, -1.0, 0.0)
    }

    /// `max(0, x) + min(0, alpha (exp(x / alpha) - 1))`.
    pub(in crate::import) fn celu(
        &mut self,
        name: &str,
        x: usize,
        alpha: f32,
    ) -> Result<usize, NetworkError> {
        let elu = Activation::Elu {
            alpha: 1.0,
            scale: 1.0,
        };
        let place = self.scaled(name, x, 1.0 / alpha, 0.0)?;
        let place = self.apply(name, elu, place)?;
        self.scaled(name, place, alpha, 0.0)
    }

    /// `x g(x)`.
    pub(in crate::import) fn gated(
        &mut self,
        name: &str,
        x: usize,
        g: Activation,
    ) -> Result<usize, NetworkError> {
        let gate = self.apply(name, g, x)?;
        self.append(name, Op::Multiply, &[x, gate])
    }

    /// `x hard_sigmoid(x)`, with a slope of 1/6.
    pub(in crate::import) fn hard_swish(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let g = Activation::HardSigmoid {
            alpha: 1.0 / 6.0,
            beta: 0.5,
        };
        self.gated(name, x, g)
    }

    /// `x tanh(softplus(x))`.
    pub(in crate::import) fn mish(&mut self, name: &str, x: usize) -> Result<usize, NetworkError> {
        let softplus = self.apply(name, Activation::Softplus, x)?;
        let tanh = self.apply(name, Activation::Tanh, softplus)?;
        self.append(name, Op::Multiply, &[x, tanh])
    }

    /// `x` where positive, elsewhere `slopes x`: `relu(x) - slopes relu(-x)`, with a slope for each
    /// value of the last axis or for each value.
    pub(in crate::import) fn prelu(
        &mut self,
        name: &str,
        x: usize,
        slopes: &[f32],
    ) -> Result<usize, NetworkError> {
        match slopes.first() {
            Some(&alpha) if slopes.iter().all(|&other| other == alpha) => {
                return self.apply(name, Activation::LeakyRelu { alpha }, x);
            }
            _ => {}
        }
        let held = self.nodes[x].shape.clone();
        let positive = self.apply(name, Activation::Relu, x)?;
        let negative = self.scaled(name, x, -1.0, 0.0)?;
        let negative = self.apply(name, Activation::Relu, negative)?;
        let gain: Vec<f32> = slopes.iter().map(|slope| -slope).collect();
        let offset = vec![0.0; gain.len()];
        let negative = self.of_each(name, negative, gain, offset)?;
        let negative = self.reshaped(name, negative, &held)?;
        self.append(name, Op::Add, &[positive, negative])
    }

    /// `x - tanh(x)`.
    pub(in crate::import) fn tanh_shrink(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let tanh = self.apply(name, Activation::Tanh, x)?;
        self.difference(name, x, tanh)
    }

    /// `x` less what of it is within `threshold`.
    pub(in crate::import) fn soft_shrink(
        &mut self,
        name: &str,
        x: usize,
        threshold: f32,
    ) -> Result<usize, NetworkError> {
        let inner = self.clipped(name, x, -threshold, threshold)?;
        self.difference(name, x, inner)
    }

    /// `(x + sqrt(x^2 + b)) / 2`.
    pub(in crate::import) fn squareplus(
        &mut self,
        name: &str,
        x: usize,
        b: f32,
    ) -> Result<usize, NetworkError> {
        let square = self.append(name, Op::Multiply, &[x, x])?;
        let sum = self.scaled(name, square, 1.0, b)?;
        let root = self.apply(name, Activation::Root, sum)?;
        let sum = self.append(name, Op::Add, &[x, root])?;
        self.scaled(name, sum, 0.5, 0.0)
    }

    /// `(x + 1)^2 / 4` between -1 and 1, zero below and `x` above.
    pub(in crate::import) fn sparse_plus(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let held = self.clipped(name, x, -1.0, 1.0)?;
        let half = self.scaled(name, held, 0.5, 0.5)?;
        let square = self.append(name, Op::Multiply, &[half, half])?;
        let above = self.scaled(name, x, 1.0, -1.0)?;
        let above = self.apply(name, Activation::Relu, above)?;
        self.append(name, Op::Add, &[square, above])
    }

    /// A function that an activation of this name is made of; none where there is none.
    pub(in crate::import) fn named_composite(
        &mut self,
        name: &str,
        function: &str,
        x: usize,
    ) -> Option<Result<usize, NetworkError>> {
        Some(match function {
            "relu6" => self.clipped(name, x, 0.0, 6.0),
            "hard_tanh" => self.clipped(name, x, -1.0, 1.0),
            "hard_silu" | "hard_swish" => self.hard_swish(name, x),
            "mish" => self.mish(name, x),
            "log_sigmoid" => self.log_sigmoid(name, x),
            "celu" => self.celu(name, x, 1.0),
            "tanh_shrink" => self.tanh_shrink(name, x),
            "soft_shrink" => self.soft_shrink(name, x, 0.5),
            "squareplus" => self.squareplus(name, x, 4.0),
            "sparse_plus" => self.sparse_plus(name, x),
            "sparse_sigmoid" => {
                let (alpha, beta) = (0.5, 0.5);
                self.apply(name, Activation::HardSigmoid { alpha, beta }, x)
            }
            _ => return None,
        })
    }
}
