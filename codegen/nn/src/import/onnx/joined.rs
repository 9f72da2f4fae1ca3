//! Several values beside each other: sums, products, quotients, the larger and the smaller. Values
//! of fewer axes, or with axes of length 1, are repeated as NumPy broadcasts them.

use super::axes::broadcast;
use super::{Import, Node, Value};
use crate::import::shapes::{self, spread_places};
use crate::{NetworkError, Op};

/// Number from which on a softplus of it is itself, within 3e-7.
const LINE: f64 = 15.0;

impl<'a> Import<'a> {
    /// Values brought to one shape and one order of axes: their nodes, and the value that has
    /// their shape.
    fn aligned(
        &mut self,
        node: &Node<'_>,
        values: Vec<Value>,
    ) -> Result<(Vec<usize>, Value), NetworkError> {
        let Some(first) = values.first().cloned() else {
            return Err(node.malformed("it reads nothing"));
        };
        let mut dims = first.dims();
        for value in &values {
            dims = broadcast(node, &dims, &value.dims())?;
        }
        let length: usize = dims.iter().product();
        let alike = values
            .iter()
            .all(|value| value.shape == first.shape && value.batch == first.batch);
        let last = alike && values.iter().any(|value| value.last);
        let mut from = Vec::new();
        let mut result = None;
        for value in values {
            let value = if last {
                self.channels_last(node, value)?
            } else if alike {
                self.as_written(node, value)?
            } else {
                let own = value.dims();
                let value = self.flat(node, value)?;
                let place = if value.len() == length {
                    self.held_as(node, value.place, vec![length])?
                } else {
                    let op = shapes::selection(&spread_places(&own, &dims), vec![length]);
                    self.push(node, op, value.place)?
                };
                Value::of(place, dims.clone(), first.batch)
            };
            from.push(value.place);
            result.get_or_insert(value);
        }
        let result = result.ok_or_else(|| node.malformed("it reads nothing"))?;
        Ok((from, result))
    }

    fn values(&self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let inputs = 0..node.proto.input.len();
        inputs.map(|input| self.value(node, input)).collect()
    }

    pub(super) fn sum(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let values = self.values(node)?;
        let (from, result) = self.aligned(node, values)?;
        let place = self.network.append(&node.name, Op::Add, &from)?;
        Ok(vec![Value { place, ..result }])
    }

    /// A difference, a product or a quotient of two values; the larger or smaller, or the mean, of
    /// several.
    pub(super) fn joined(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let values = self.values(node)?;
        let (from, result) = self.aligned(node, values)?;
        let name = node.name.as_str();
        let network = &mut self.network;
        let place = match (node.proto.op_type.as_str(), from.as_slice()) {
            ("Sub", &[a, b]) => network.difference(name, a, b)?,
            ("Mul", &[a, b]) => network.append(name, Op::Multiply, &[a, b])?,
            ("Div", &[a, b]) => network.quotient(name, a, b)?,
            ("Max", &[first, ref rest @ ..]) => {
                (rest.iter()).try_fold(first, |most, &other| network.larger(name, most, other))?
            }
            ("Min", &[first, ref rest @ ..]) => (rest.iter())
                .try_fold(first, |least, &other| network.smaller(name, least, other))?,
            ("Mean", all) => {
                let sum = network.append(name, Op::Add, all)?;
                network.scaled(name, sum, 1.0 / all.len() as f32, 0.0)?
            }
            (op, all) => {
                let what = format!("{op} of {} values", all.len());
                return Err(node.unsupported(what, "two values, or a value and weights, work"));
            }
        };
        Ok(vec![Value { place, ..result }])
    }

    /// Notes where a value is positive; false where the node says something else.
    pub(super) fn sign(&mut self, node: &Node<'a>) -> Result<bool, NetworkError> {
        let op = node.proto.op_type.as_str();
        if !["Greater", "GreaterOrEqual", "Less", "LessOrEqual"].contains(&op) {
            return Ok(false);
        }
        let bound = self.constants.get(node.input(1).unwrap_or(""));
        let bound = bound.filter(|c| c.len() == 1).map(super::Constant::numbers);
        if op == "Greater" && bound.is_some_and(|bound| bound[0] >= LINE) {
            let value = self.value(node, 0)?;
            if let Some(output) = node.proto.output.first() {
                self.large.insert(output, value.place);
            }
            return Ok(true);
        }
        let zero = |input: usize| {
            let constant = self.constants.get(node.input(input).unwrap_or(""));
            constant.is_some_and(|c| c.numbers().iter().all(|&n| n == 0.0) && c.len() == 1)
        };
        let greater = op.starts_with("Greater");
        let (input, positive) = match [zero(0), zero(1)] {
            [false, true] => (0, greater),
            [true, false] => (1, !greater),
            _ => return Ok(false),
        };
        let value = self.value(node, input)?;
        if let Some(output) = node.proto.output.first() {
            self.signs.insert(output, (value, positive));
        }
        Ok(true)
    }

    /// One value where another is positive, a third elsewhere.
    pub(super) fn choice(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let nearest = "choices by the sign of x between multiples of x and exp(x) - 1 work";
        if let Some(&z) = self.large.get(node.input(0).unwrap_or("")) {
            // Beyond the bound the two differ by less than 3e-7.
            let (a, b) = (self.value(node, 1)?, self.value(node, 2)?);
            if self.network.nears(z, a.place, b.place) {
                return Ok(vec![b]);
            }
        }
        let found = self.signs.get(node.input(0).unwrap_or("")).cloned();
        let jumps = || node.unsupported("a choice by values, which may jump,", nearest);
        let (z, positive) = found.ok_or_else(jumps)?;
        let mut parts = [None; 2];
        for (part, input) in parts.iter_mut().zip([1, 2]) {
            match self.constants.get(node.input(input).unwrap_or("")) {
                Some(constant) if constant.numbers().iter().all(|&n| n == 0.0) => {}
                Some(_) => {
                    return Err(node.unsupported("a choice of a constant, which jumps,", nearest));
                }
                None => {
                    let value = self.value(node, input)?;
                    if (value.last, &value.shape) != (z.last, &z.shape) {
                        return Err(jumps());
                    }
                    *part = Some(value.place);
                }
            }
        }
        if !positive {
            parts.reverse();
        }
        if parts == [None; 2] {
            return Err(node.unsupported("a choice between constants", nearest));
        }
        let place = self.network.piecewise(&node.name, z.place, parts)?;
        Ok(vec![Value { place, ..z }])
    }

    /// A value to the power of one number.
    pub(super) fn power(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let constant = self.constants.get(node.input(1).unwrap_or(""));
        let exponents = constant.map(super::Constant::numbers).unwrap_or_default();
        let exponent = exponents.first().copied();
        let single = exponents.iter().all(|&other| Some(other) == exponent);
        let (Some(exponent), true) = (exponent, single) else {
            return Err(node.unsupported(
                "a Pow whose exponent is no single number",
                "one constant exponent works",
            ));
        };
        let value = self.value(node, 0)?;
        if exponents.len() > value.len() {
            return Err(node.unsupported(
                "a Pow that makes its value larger",
                "one constant exponent works",
            ));
        }
        let place = self
            .network
            .power(&node.name, value.place, exponent as f32)?;
        Ok(vec![Value { place, ..value }])
    }
}
