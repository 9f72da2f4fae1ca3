//! Operators on each value by itself: sums, products, bounds, and activations within an operator.

use super::Import;
use super::file::Operator;
use crate::import::shapes;
use crate::import::tensor::Tensor;
use crate::{Activation, NetworkError, Op};

impl Import<'_> {
    /// The activation that an operator has within it.
    pub(super) fn fused(
        &mut self,
        name: &str,
        place: usize,
        code: u8,
    ) -> Result<usize, NetworkError> {
        let g = match code {
            0 => return Ok(place),
            1 => Activation::Relu,
            2 | 3 => {
                let name = self.free_name(&format!("{name} activation"));
                return self.clipped(&name, place, code == 3);
            }
            4 => Activation::Tanh,
            other => {
                let what = format!("the fused activation {other}");
                return Err(NetworkError::unsupported(name, what, "the nearest is ReLU"));
            }
        };
        let name = self.free_name(&format!("{name} activation"));
        self.network.push(&name, Op::Activation(g), vec![place])
    }

    /// The same gain for all channels of a node.
    pub(super) fn scale(&self, x: usize, gain: f32) -> Op {
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        Op::Scale {
            gain: vec![gain; channels],
            offset: vec![0.0; channels],
        }
    }

    /// Bounds of 0 and 6, or of -1 and 1, as a hard sigmoid between them.
    pub(super) fn clipped(
        &mut self,
        name: &str,
        x: usize,
        six: bool,
    ) -> Result<usize, NetworkError> {
        let (low, width) = if six { (0.0, 6.0) } else { (-1.0, 2.0) };
        let g = Activation::HardSigmoid {
            alpha: 1.0 / width,
            beta: -low / width,
        };
        let inner = self.free_name(&format!("{name} bounds"));
        let bounded = self.network.push(&inner, Op::Activation(g), vec![x])?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        let op = Op::Scale {
            gain: vec![width; channels],
            offset: vec![low; channels],
        };
        self.network.push(name, op, vec![bounded])
    }

    /// A value divided by weights.
    pub(super) fn quotient(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let Some(constant) = self.constant(operator, 1)?.cloned() else {
            return Err(NetworkError::unsupported(
                name,
                "DIV by a value",
                "division by a constant works",
            ));
        };
        let x = self.value(operator, 0, name)?;
        let gain: Vec<f32> = self
            .spread(&constant, x, name)?
            .iter()
            .map(|c| 1.0 / c)
            .collect();
        let offset = vec![0.0; gain.len()];
        self.scaled(name, x, gain, offset)
    }

    /// A gain and an offset for each channel, or for each value.
    fn scaled(
        &mut self,
        name: &str,
        x: usize,
        gain: Vec<f32>,
        offset: Vec<f32>,
    ) -> Result<usize, NetworkError> {
        let shape = self.network.nodes[x].shape.clone();
        if shape.last() == Some(&gain.len()) {
            return self.network.push(name, Op::Scale { gain, offset }, vec![x]);
        }
        let flat = self.free_name(&format!("{name} flat"));
        let flat = self
            .network
            .push(&flat, Op::Reshape(vec![gain.len()]), vec![x])?;
        let scale = self.free_name(&format!("{name} scale"));
        let scaled = self
            .network
            .push(&scale, Op::Scale { gain, offset }, vec![flat])?;
        self.network.push(name, Op::Reshape(shape), vec![scaled])
    }

    /// Values added, or a value and weights; with the signs of both.
    pub(super) fn sum(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
        signs: [f32; 2],
    ) -> Result<usize, NetworkError> {
        for (value, weights) in [(0, 1), (1, 0)] {
            let Some(constant) = self.constant(operator, weights)?.cloned() else {
                continue;
            };
            let x = self.value(operator, value, name)?;
            let offset = self.spread(&constant, x, name)?;
            let gain = vec![signs[value]; offset.len()];
            let offset = offset.iter().map(|o| signs[weights] * o).collect();
            return self.scaled(name, x, gain, offset);
        }
        if signs != [1.0; 2] {
            let (a, b) = (
                self.value(operator, 0, name)?,
                self.value(operator, 1, name)?,
            );
            let op = self.scale(b, -1.0);
            let b = self
                .network
                .push(&self.free_name(&format!("{name} negative")), op, vec![b])?;
            return self.network.push(name, Op::Add, vec![a, b]);
        }
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<_, _>>()?;
        self.network.push(name, Op::Add, from)
    }

    /// A value and weights, or a value and its own sigmoid.
    pub(super) fn product(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        for (value, weights) in [(0, 1), (1, 0)] {
            if let Some(constant) = self.constant(operator, weights)?.cloned() {
                let x = self.value(operator, value, name)?;
                let gain = self.spread(&constant, x, name)?;
                let offset = vec![0.0; gain.len()];
                return self.scaled(name, x, gain, offset);
            }
            let (x, gate) = (
                self.value(operator, value, name)?,
                self.value(operator, weights, name)?,
            );
            let node = &self.network.nodes[gate];
            if node.op == Op::Activation(Activation::Sigmoid) && node.from == [x] {
                return self
                    .network
                    .push(name, Op::Activation(Activation::Swish), vec![x]);
            }
        }
        Err(NetworkError::unsupported(
            name,
            "MUL of two values",
            "x * sigmoid(x) works, and ADD",
        ))
    }

    /// One number for each channel of a node, or for each value.
    fn spread(&self, constant: &Tensor, x: usize, name: &str) -> Result<Vec<f32>, NetworkError> {
        shapes::spread(
            name,
            &constant.shape,
            &constant.values,
            &self.network.nodes[x].shape,
        )
    }
}
