//! Sums and products: of two values, or of one and weights, which make a scale. `x sigmoid(x)` and
//! `x (1 + erf(x / sqrt 2)) / 2` are recognised as the activations that they are.

use super::layers::spread;
use super::{Gelu, Import, Node, Value};
use crate::import::onnx::constant::Constant;
use crate::import::tensor::Tensor;
use crate::{Activation, NetworkError, Op};

impl Import<'_> {
    pub(super) fn arithmetic(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let op = node.proto.op_type.as_str();
        if op == "Erf" {
            return self.erf(node);
        }
        let constant = |input: usize| {
            let name = node.proto.input.get(input).map_or("", String::as_str);
            match self.constants.get(name) {
                Some(Constant::Floats(tensor)) => Some(tensor.clone()),
                _ => None,
            }
        };
        match (constant(0), constant(1)) {
            (None, Some(right)) if op != "Sum" => self.with_constant(node, 0, &right, false),
            (Some(left), None) if op != "Sum" => self.with_constant(node, 1, &left, true),
            _ if op == "Add" || op == "Sum" => self.sum(node),
            _ if op == "Mul" => self.product(node),
            _ => Err(node.unsupported(
                format!("{op} of two values"),
                "Add, or weights on one side, work",
            )),
        }
    }

    /// The value at an input, even if it is on its way to a GELU.
    fn any_value(&self, node: &Node<'_>, input: usize) -> Result<Value, NetworkError> {
        let name = node.proto.input.get(input).map_or("", String::as_str);
        let value = self.values.get(name).cloned();
        value.ok_or_else(|| {
            node.malformed(format!("it reads {name:?}, which no node before it gives"))
        })
    }

    /// `x op c`, or `c op x` where `reversed`.
    fn with_constant(
        &mut self,
        node: &Node<'_>,
        input: usize,
        constant: &Tensor,
        reversed: bool,
    ) -> Result<Vec<Value>, NetworkError> {
        let op = node.proto.op_type.as_str();
        let value = self.any_value(node, input)?;
        if let Some(gelu) = value.gelu {
            let scalar = constant.values.as_slice();
            let next = match (op, scalar) {
                ("Add", [c]) if *c == 1.0 && !gelu.plus_one => Gelu {
                    plus_one: true,
                    ..gelu
                },
                ("Mul", [c]) if *c == 0.5 && gelu.plus_one && !gelu.half => {
                    Gelu { half: true, ..gelu }
                }
                ("Div", [c]) if *c == 2.0 && gelu.plus_one && !gelu.half && !reversed => {
                    Gelu { half: true, ..gelu }
                }
                _ => return Err(node.unsupported("an error function", "Erf works within GELU")),
            };
            return self.gelu(node, value, next);
        }
        let place = self.shaped(node, &value)?;
        let value = Value { place, ..value };
        let c = spread(node, constant, &value)?;
        let ones = vec![1.0; c.len()];
        let zeros = vec![0.0; c.len()];
        let map = |f: fn(f32) -> f32| c.iter().copied().map(f).collect::<Vec<f32>>();
        let (gain, offset) = match (op, reversed) {
            ("Add", _) => (ones, c),
            ("Sub", false) => (ones, map(|c| -c)),
            ("Sub", true) => (vec![-1.0; c.len()], c),
            ("Mul", _) => (c, zeros),
            ("Div", false) => (map(|c| 1.0 / c), zeros),
            _ => return Err(node.unsupported("division by a value", "multiply by weights")),
        };
        let place = self.push(node, Op::Scale { gain, offset }, value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    fn sum(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let mut values = Vec::new();
        for input in 0..node.proto.input.len() {
            values.push(self.value(node, input)?);
        }
        let last = values.iter().any(|value| value.last);
        let mut from = Vec::new();
        let mut first = None;
        for value in values {
            let value = if last {
                self.channels_last(node, value)?
            } else {
                self.as_written(node, value)?
            };
            from.push(value.place);
            first.get_or_insert(value);
        }
        let first = first.ok_or_else(|| node.malformed("it reads nothing"))?;
        let name = self.free_name(&node.name);
        let place = self.network.push(&name, Op::Add, from)?;
        Ok(vec![Value { place, ..first }])
    }

    fn product(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let (a, b) = (self.any_value(node, 0)?, self.any_value(node, 1)?);
        for (x, other) in [(&a, &b), (&b, &a)] {
            let reads_x = |place: usize| self.network.nodes[place].from.first() == Some(&x.place);
            if let Some(gelu) = other.gelu {
                // x, or x with its half already.
                let halved = self.is_scaled(x.place, gelu.of, 0.5) && !gelu.half;
                if (x.place == gelu.of || halved) && gelu.plus_one && !gelu.times_x {
                    let next = Gelu {
                        times_x: true,
                        half: gelu.half || halved,
                        ..gelu
                    };
                    return self.gelu(node, other.clone(), next);
                }
            } else if self.network.nodes[other.place].op == Op::Activation(Activation::Sigmoid)
                && reads_x(other.place)
            {
                let place = self.push(node, Op::Activation(Activation::Swish), x.place)?;
                return Ok(vec![Value { place, ..x.clone() }]);
            }
        }
        Err(node.unsupported("a product of two values", "x * Sigmoid(x) works, and Add"))
    }

    /// `erf(x / sqrt 2)` begins a GELU.
    fn erf(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let from = self.network.nodes[value.place].from.first().copied();
        match from {
            Some(of) if self.is_scaled(value.place, of, std::f32::consts::FRAC_1_SQRT_2) => {
                let gelu = Gelu {
                    of,
                    plus_one: false,
                    times_x: false,
                    half: false,
                };
                Ok(vec![Value {
                    gelu: Some(gelu),
                    ..value
                }])
            }
            _ => Err(node.unsupported(
                "an error function",
                "Erf works within GELU: x (1 + erf(x / sqrt 2)) / 2",
            )),
        }
    }

    /// Returns true if `place` is `factor` times `of`.
    fn is_scaled(&self, place: usize, of: usize, factor: f32) -> bool {
        let node = &self.network.nodes[place];
        let Op::Scale { gain, offset } = &node.op else {
            return false;
        };
        node.from == [of]
            && gain.iter().all(|gain| (gain - factor).abs() < 1e-5)
            && offset.iter().all(|&offset| offset == 0.0)
    }

    /// One step further; after the last the layer is there.
    fn gelu(
        &mut self,
        node: &Node<'_>,
        value: Value,
        next: Gelu,
    ) -> Result<Vec<Value>, NetworkError> {
        if next.times_x && next.half {
            let place = self.push(node, Op::Activation(Activation::Gelu), next.of)?;
            return Ok(vec![Value {
                place,
                gelu: None,
                ..value
            }]);
        }
        Ok(vec![Value {
            gelu: Some(next),
            ..value
        }])
    }
}
