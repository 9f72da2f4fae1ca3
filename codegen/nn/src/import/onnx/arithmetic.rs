//! Sums and products: of two values, or of one and weights, which make a scale. `x sigmoid(x)` and
//! `x (1 + erf(x / sqrt 2)) / 2` are recognised as the activations that they are.

use super::axes::broadcast;
use super::{Gelu, Import, Node, Value};
use crate::import::onnx::constant::Constant;
use crate::import::shapes::{self, spread_places};
use crate::import::tensor::Tensor;
use crate::{Activation, NetworkError, Op};

impl Import<'_> {
    pub(super) fn arithmetic(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let op = node.proto.op_type.as_str();
        if op == "Erf" {
            return self.erf(node);
        }
        let constant = |input: usize| match self.constants.get(node.input(input).unwrap_or("")) {
            Some(Constant::Floats(tensor)) => Some(tensor.clone()),
            _ => None,
        };
        let pair = node.proto.input.len() == 2;
        match (constant(0), constant(1)) {
            (None, Some(right)) if pair => self.with_constant(node, 0, &right, false),
            (Some(left), None) if pair => self.with_constant(node, 1, &left, true),
            _ if op == "Add" || op == "Sum" => self.sum(node),
            _ if op == "Mul" => self.product(node),
            _ => self.joined(node),
        }
    }

    /// The value at an input, even if it is on its way to a GELU.
    pub(super) fn any_value(&self, node: &Node<'_>, input: usize) -> Result<Value, NetworkError> {
        let name = node.input(input).unwrap_or("");
        if self.constants.contains_key(name) {
            let what = format!("{} of a constant, {name:?},", node.proto.op_type);
            return Err(node.unsupported(what, "compute it before exporting"));
        }
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
                ("Add" | "Sum", [c]) if *c == 1.0 && !gelu.plus_one => Gelu {
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
        let (value, c) = self.channelled(node, value, constant)?;
        let ones = vec![1.0; c.len()];
        let zeros = vec![0.0; c.len()];
        let map = |f: fn(f32) -> f32| c.iter().copied().map(f).collect::<Vec<f32>>();
        let (gain, offset) = match (op, reversed) {
            ("Add" | "Sum", _) => (ones, c),
            ("Sub", false) => (ones, map(|c| -c)),
            ("Sub", true) => (vec![-1.0; c.len()], c),
            ("Mul", _) => (c, zeros),
            ("Div", false) => (map(|c| 1.0 / c), zeros),
            // c / x
            _ => {
                let g = Op::Activation(Activation::Reciprocal);
                let place = self.push(node, g, value.place)?;
                let op = Op::Scale {
                    gain: c,
                    offset: zeros,
                };
                let place = self.push(node, op, place)?;
                return Ok(vec![Value { place, ..value }]);
            }
        };
        let place = self.push(node, Op::Scale { gain, offset }, value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    /// The value, its node so that the constant beside it varies along the last axis alone, and the
    /// constant along that axis.
    pub(super) fn channelled(
        &mut self,
        node: &Node<'_>,
        value: Value,
        constant: &Tensor,
    ) -> Result<(Value, Vec<f32>), NetworkError> {
        let lead = value.dims().len() < constant.shape.len();
        let dims = value.dims();
        let all = broadcast(node, &dims, &constant.shape)?;
        if all.iter().product::<usize>() != value.len() {
            // The value repeated along the axes that the constant has and it has not.
            let value = self.flat(node, value)?;
            let op = shapes::selection(&spread_places(&dims, &all), vec![all.iter().product()]);
            let place = self.push(node, op, value.place)?;
            let value = Value::of(place, all, value.batch);
            return self.channelled(node, value, constant);
        }
        if lead {
            // The constant has more axes, all of length 1.
            let value = self.flat(node, value)?;
            let value = value.reshaped(all.clone(), None);
            let flat = Tensor {
                shape: constant
                    .shape
                    .iter()
                    .copied()
                    .skip_while(|&n| n == 1)
                    .collect(),
                values: constant.values.clone(),
            };
            return self.channelled(node, value, &flat);
        }
        if let [c] = constant.values.as_slice() {
            let place = if value.shape.len() > 3 {
                value.place
            } else {
                self.shaped(node, &value)?
            };
            let channels = self.network.nodes[place].shape.last().copied().unwrap_or(1);
            return Ok((Value { place, ..value }, vec![*c; channels]));
        }
        // The axes along which it varies.
        let ahead = dims.len() - constant.shape.len();
        let varying: Vec<usize> = (0..constant.shape.len())
            .filter(|&axis| constant.shape[axis] != 1)
            .map(|axis| axis + ahead)
            .collect();
        let inner = |axis: usize| match value.batch {
            Some(batch) if axis > batch => axis - 1,
            _ => axis,
        };
        let places: Vec<usize> = varying.iter().map(|&axis| inner(axis)).collect();
        let axes = value.shape.len();
        let here = match places.as_slice() {
            [place] if value.last => *place == 0 && axes > 1 || axes == 1,
            [place] => place + 1 == axes,
            _ => false,
        };
        if here && axes <= 3 {
            let place = self.shaped(node, &value)?;
            return Ok((Value { place, ..value }, constant.values.clone()));
        }
        if places == [0] && value.batch == Some(0) && (2..=3).contains(&axes) {
            let value = self.channels_last(node, value)?;
            return Ok((value, constant.values.clone()));
        }
        // Along several axes: a number for every value.
        let value = self.flat(node, value)?;
        let c: Vec<f32> = spread_places(&constant.shape, &dims)
            .into_iter()
            .map(|place| constant.values[place])
            .collect();
        let place = self.held_as(node, value.place, vec![c.len()])?;
        Ok((Value { place, ..value }, c))
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
        self.joined(node)
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
