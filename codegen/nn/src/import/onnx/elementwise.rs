//! Operators on each value by itself that are no plain activation: bounds, signs, casts.

use super::constant::{DOUBLE, FLOAT, type_name};
use super::{Import, Node, Value};
use crate::{Activation, NetworkError, Op};

impl Import<'_> {
    /// From float32 to float32, or to what is computed in float32 here too.
    pub(super) fn cast(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        match node.int("to", 0) as i32 {
            FLOAT | DOUBLE => Ok(vec![self.value(node, 0)?]),
            other => Err(node.unsupported(
                format!("a cast of a value to {}", type_name(other)),
                "export in float32",
            )),
        }
    }

    /// `gain x + offset` with one number for all.
    fn scaled(
        &mut self,
        node: &Node<'_>,
        place: usize,
        gain: f32,
        offset: f32,
    ) -> Result<usize, NetworkError> {
        let channels = self.network.nodes[place].shape.last().copied().unwrap_or(1);
        let (gain, offset) = (vec![gain; channels], vec![offset; channels]);
        self.push(node, Op::Scale { gain, offset }, place)
    }

    pub(super) fn negated(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let place = self.scaled(node, value.place, -1.0, 0.0)?;
        Ok(vec![Value { place, ..value }])
    }

    /// `max(0, x) + min(0, alpha (exp(x / alpha) - 1))`.
    pub(super) fn celu(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let alpha = node.float("alpha", 1.0);
        let elu = Op::Activation(Activation::Elu {
            alpha: 1.0,
            scale: 1.0,
        });
        if alpha == 1.0 {
            let place = self.push(node, elu, value.place)?;
            return Ok(vec![Value { place, ..value }]);
        }
        let place = self.scaled(node, value.place, 1.0 / alpha, 0.0)?;
        let place = self.push(node, elu, place)?;
        let place = self.scaled(node, place, alpha, 0.0)?;
        Ok(vec![Value { place, ..value }])
    }

    /// Bounds as a hard sigmoid between them; a bound of 0 below alone is a ReLU.
    pub(super) fn clip(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let bound = |input: usize, attribute: &str, open: f32| -> Result<f32, NetworkError> {
            if node.opset < 11 {
                return Ok(node.float(attribute, open));
            }
            Ok(match self.weights(node, input)? {
                Some(tensor) if tensor.values.len() == 1 => tensor.values[0],
                Some(_) => return Err(node.malformed("a bound that is no single number")),
                None => open,
            })
        };
        let (low, high) = (bound(1, "min", f32::MIN)?, bound(2, "max", f32::MAX)?);
        let place = self.clipped(node, value.place, low, high)?;
        Ok(vec![Value { place, ..value }])
    }

    /// The larger, or the smaller, of a value and one number.
    pub(super) fn bounded(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let is_constant = |input: usize| {
            let name = node.input(input).unwrap_or("");
            self.constants.contains_key(name)
        };
        let (value, bound) = match [is_constant(0), is_constant(1)] {
            [false, true] if node.proto.input.len() == 2 => (0, 1),
            [true, false] if node.proto.input.len() == 2 => (1, 0),
            _ => {
                let what = format!("{} of values", node.proto.op_type);
                return Err(node.unsupported(what, "a value and one number work"));
            }
        };
        let bound = self.needed(node, bound)?.values.clone();
        let Some(&first) = bound
            .first()
            .filter(|&first| bound.iter().all(|c| c == first))
        else {
            let what = format!("{} of a value and several numbers", node.proto.op_type);
            return Err(node.unsupported(what, "a value and one number work"));
        };
        let value = self.value(node, value)?;
        if bound.len() > value.len() {
            return Err(node.unsupported("a bound larger than its value", "one number works"));
        }
        let (low, high) = if node.proto.op_type == "Max" {
            (first, f32::MAX)
        } else {
            (f32::MIN, first)
        };
        let place = self.clipped(node, value.place, low, high)?;
        Ok(vec![Value { place, ..value }])
    }

    fn clipped(
        &mut self,
        node: &Node<'_>,
        place: usize,
        low: f32,
        high: f32,
    ) -> Result<usize, NetworkError> {
        let open = |bound: f32| bound.abs() >= 1e30;
        match (open(low), open(high)) {
            (true, true) => Ok(place),
            (false, true) => {
                let shifted = if low == 0.0 {
                    place
                } else {
                    self.scaled(node, place, 1.0, -low)?
                };
                let place = self.push(node, Op::Activation(Activation::Relu), shifted)?;
                if low == 0.0 {
                    Ok(place)
                } else {
                    self.scaled(node, place, 1.0, low)
                }
            }
            (true, false) => {
                let shifted = self.scaled(node, place, -1.0, high)?;
                let place = self.push(node, Op::Activation(Activation::Relu), shifted)?;
                self.scaled(node, place, -1.0, high)
            }
            (false, false) if low < high => {
                let width = high - low;
                let g = Activation::HardSigmoid {
                    alpha: 1.0 / width,
                    beta: -low / width,
                };
                let place = self.push(node, Op::Activation(g), place)?;
                self.scaled(node, place, width, low)
            }
            _ => Err(node.unsupported(format!("Clip between {low} and {high}"), "use min < max")),
        }
    }

    /// One slope for all channels is a leaky ReLU.
    pub(super) fn prelu(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let slope = self.needed(node, 1)?.values.clone();
        match slope.first() {
            Some(&alpha) if slope.iter().all(|&other| other == alpha) => {
                self.activation(node, Activation::LeakyRelu { alpha })
            }
            _ => Err(node.unsupported(
                "PRelu of a slope for each channel",
                "one slope for all works",
            )),
        }
    }
}
