//! Operators on each value by itself: sums, products, bounds, and activations within an operator.

use super::file::Operator;
use super::{Import, held, product, tensor};
use crate::import::shapes::{self, spread_places};
use crate::import::tensor::Tensor;
use crate::limits::MAX_LENGTH;
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
                let (low, high) = if code == 3 { (0.0, 6.0) } else { (-1.0, 1.0) };
                return self.network.clipped(&name, place, low, high);
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

    /// The value at an input repeated to the shape of the operator's result.
    fn widened(
        &mut self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, input, name)?;
        let index = |list: &[i32], at: usize| list.get(at).copied().unwrap_or(-1);
        let own = tensor(self.model, index(&operator.inputs, input))?
            .shape
            .clone();
        let all = &tensor(self.model, index(&operator.outputs, 0))?.shape;
        let length = product(all);
        if length == self.network.nodes[x].len() {
            return Ok(x);
        }
        let fits = own.len() <= all.len()
            && product(&own) == self.network.nodes[x].len()
            && (own.iter().rev())
                .zip(all.iter().rev())
                .all(|(&n, &m)| n == 1 || n == m);
        if !fits || length > MAX_LENGTH {
            let message = format!("{own:?} spread over {all:?}");
            return Err(NetworkError::malformed(name, message));
        }
        let op = shapes::selection(&spread_places(&own, all), held(all, length));
        self.network.append(name, op, &[x])
    }

    /// The values at both inputs, repeated to the shape of the result.
    fn both(&mut self, operator: &Operator<'_>, name: &str) -> Result<[usize; 2], NetworkError> {
        let (a, b) = (
            self.widened(operator, 0, name)?,
            self.widened(operator, 1, name)?,
        );
        // The same number of values, perhaps with other axes of length 1.
        let shape = self.network.nodes[a].shape.clone();
        let b = self.network.reshaped(name, b, &shape)?;
        Ok([a, b])
    }

    /// A value divided by weights or another value, or weights by a value.
    pub(super) fn quotient(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        if let Some(constant) = self.constant(operator, 1)?.cloned() {
            let x = self.widened(operator, 0, name)?;
            let gain = self.spread(&constant, x, name)?;
            let gain: Vec<f32> = gain.iter().map(|c| 1.0 / c).collect();
            let offset = vec![0.0; gain.len()];
            return self.network.of_each(name, x, gain, offset);
        }
        if let Some(constant) = self.constant(operator, 0)?.cloned() {
            let x = self.widened(operator, 1, name)?;
            let gain = self.spread(&constant, x, name)?;
            let g = Op::Activation(Activation::Reciprocal);
            let inverse = self.network.append(name, g, &[x])?;
            let offset = vec![0.0; gain.len()];
            return self.network.of_each(name, inverse, gain, offset);
        }
        let [a, b] = self.both(operator, name)?;
        self.network.quotient(name, a, b)
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
            let x = self.widened(operator, value, name)?;
            let offset = self.spread(&constant, x, name)?;
            let gain = vec![signs[value]; offset.len()];
            let offset = offset.iter().map(|o| signs[weights] * o).collect();
            return self.network.of_each(name, x, gain, offset);
        }
        let [a, b] = self.both(operator, name)?;
        if signs != [1.0; 2] {
            return self.network.difference(name, a, b);
        }
        self.network.append(name, Op::Add, &[a, b])
    }

    /// A value and weights, a value and its own sigmoid, or two values.
    pub(super) fn product(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        for (value, weights) in [(0, 1), (1, 0)] {
            if let Some(constant) = self.constant(operator, weights)?.cloned() {
                let x = self.widened(operator, value, name)?;
                let gain = self.spread(&constant, x, name)?;
                let offset = vec![0.0; gain.len()];
                return self.network.of_each(name, x, gain, offset);
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
        let both = self.both(operator, name)?;
        self.network.append(name, Op::Multiply, &both)
    }

    /// The larger or the smaller of a value and weights, or of two values.
    pub(super) fn bounded(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        const MAXIMUM: i32 = 55;
        let most = operator.code == MAXIMUM;
        for (value, weights) in [(0, 1), (1, 0)] {
            let Some(constant) = self.constant(operator, weights)?.cloned() else {
                continue;
            };
            let x = self.widened(operator, value, name)?;
            let bounds = self.spread(&constant, x, name)?;
            return self.network.bounded_each(name, x, &bounds, most);
        }
        let [a, b] = self.both(operator, name)?;
        if most {
            self.network.larger(name, a, b)
        } else {
            self.network.smaller(name, a, b)
        }
    }

    /// Notes the value of which a tensor says where it is greater than zero.
    pub(super) fn sign(&mut self, operator: &Operator<'_>, name: &str) -> Result<(), NetworkError> {
        let bound = self
            .constant(operator, 1)?
            .map(|bound| bound.values.clone());
        if bound.is_none_or(|bound| bound.iter().any(|&value| value != 0.0)) {
            return Err(NetworkError::unsupported(
                name,
                "GREATER than another number than zero",
                "a choice by values jumps; the nearest is ReLU",
            ));
        }
        let x = self.value(operator, 0, name)?;
        self.signs
            .extend(operator.outputs.iter().map(|&output| (output, x)));
        Ok(())
    }

    /// One value where another is positive, a third elsewhere.
    pub(super) fn choice(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let condition = operator.inputs.first().copied().unwrap_or(-1);
        let Some(&z) = self.signs.get(&condition) else {
            return Err(NetworkError::unsupported(
                name,
                "a choice by values, which may jump,",
                "choices by the sign of x between multiples of x and exp(x) - 1 work",
            ));
        };
        let part = |input: usize| -> Result<Option<usize>, NetworkError> {
            match self.constant(operator, input)? {
                Some(constant) if constant.values.iter().all(|&value| value == 0.0) => Ok(None),
                Some(_) => Err(NetworkError::unsupported(
                    name,
                    "a choice of a constant, which jumps,",
                    "the nearest is ReLU",
                )),
                None => self.value(operator, input, name).map(Some),
            }
        };
        let parts = [part(1)?, part(2)?];
        self.network.piecewise(name, z, parts)
    }

    /// A slope for each value below zero.
    pub(super) fn prelu(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let slopes = self.weights(operator, 1, name)?.clone();
        let slopes = self.spread(&slopes, x, name)?;
        self.network.prelu(name, x, &slopes)
    }

    /// A value to the power of one number.
    pub(super) fn power(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let exponents = self.weights(operator, 1, name)?.values.clone();
        match exponents.first() {
            Some(&first) if exponents.iter().all(|&other| other == first) => {
                self.network.power(name, x, first)
            }
            _ => Err(NetworkError::unsupported(
                name,
                "POW by several exponents",
                "one constant exponent works",
            )),
        }
    }

    /// Zeros around the axes after the batch.
    pub(super) fn padded(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let index = operator.inputs.first().copied().unwrap_or(-1);
        let dims = tensor(self.model, index)?.shape.clone();
        let pads = self.integers(operator, 1, name)?;
        if pads.len() != 2 * dims.len() || pads.iter().any(|&n| n < 0) {
            let message = format!("{pads:?} around {dims:?}");
            return Err(NetworkError::malformed(name, message));
        }
        if operator.inputs.len() > 2 {
            let filled = self.weights(operator, 2, name)?;
            if filled.values.iter().any(|&value| value != 0.0) {
                let what = format!("PADV2 by {:?}", filled.values);
                return Err(NetworkError::unsupported(name, what, "pad by zeros"));
            }
        }
        let mut pads: Vec<[i64; 2]> = pads.chunks(2).map(|two| [two[0], two[1]]).collect();
        let shape = &self.network.nodes[x].shape;
        if pads.len() == shape.len() + 1 && pads[0] == [0; 2] {
            pads.remove(0);
        }
        let known = [&[1][..], shape].concat() == dims || *shape == dims;
        if !known || pads.len() != shape.len() {
            let what = format!("a padding of {dims:?} by {pads:?}");
            return Err(NetworkError::unsupported(
                name,
                what,
                "pad the axes after the batch",
            ));
        }
        self.network.padded(name, x, &pads)
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
