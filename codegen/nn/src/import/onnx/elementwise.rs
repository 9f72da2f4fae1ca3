//! Operators on each value by itself that are no plain activation: bounds, signs, casts.

use super::constant::{DOUBLE, FLOAT, type_name};
use super::{Import, Node, Value};
use crate::{Activation, Network, NetworkError, Op};

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

    /// A function of each value that several layers compute.
    pub(super) fn composed(
        &mut self,
        node: &Node<'_>,
        f: impl FnOnce(&mut Network, &str, usize) -> Result<usize, NetworkError>,
    ) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let place = f(&mut self.network, &node.name, value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    /// `x sigmoid(alpha x)`.
    pub(super) fn swish(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let alpha = node.float("alpha", 1.0);
        if alpha == 1.0 {
            return self.activation(node, Activation::Swish);
        }
        self.composed(node, |network, name, x| {
            let gate = network.scaled(name, x, alpha, 0.0)?;
            let gate = network.append(name, Op::Activation(Activation::Sigmoid), &[gate])?;
            network.append(name, Op::Multiply, &[x, gate])
        })
    }

    /// A value held between two bounds; a bound of 0 below alone is a ReLU.
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
        let place = (self.network).clipped(&node.name, value.place, low, high)?;
        Ok(vec![Value { place, ..value }])
    }

    /// The larger, or the smaller, of a value and constants, or of several values.
    pub(super) fn bounded(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let is_constant = |input: usize| {
            let name = node.input(input).unwrap_or("");
            self.constants.contains_key(name)
        };
        let inputs = node.proto.input.len();
        let constants: Vec<usize> = (0..inputs).filter(|&input| is_constant(input)).collect();
        let (value, bound) = match *constants.as_slice() {
            [] => return self.joined(node),
            [bound] if inputs == 2 => (1 - bound, bound),
            _ => {
                let op = &node.proto.op_type;
                let what = format!("{op} of constants and {inputs} inputs together");
                let nearest = format!("two {op} in turn work, one with the constant");
                return Err(node.unsupported(what, &nearest));
            }
        };
        let bound = self.needed(node, bound)?.clone();
        let value = self.value(node, value)?;
        let (value, bounds) = self.channelled(node, value, &bound)?;
        let largest = node.proto.op_type == "Max";
        let network = &mut self.network;
        let place = network.bounded_each(&node.name, value.place, &bounds, largest)?;
        Ok(vec![Value { place, ..value }])
    }

    /// A slope for each channel, or for each value.
    pub(super) fn prelu(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let slopes = self.needed(node, 1)?.clone();
        let value = self.value(node, 0)?;
        let (value, slopes) = self.channelled(node, value, &slopes)?;
        let place = self.network.prelu(&node.name, value.place, &slopes)?;
        Ok(vec![Value { place, ..value }])
    }
}
