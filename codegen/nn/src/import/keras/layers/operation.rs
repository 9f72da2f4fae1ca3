//! Operations of Keras 3: what `keras.ops` and the operators of Python leave in a functional model.

use super::Import;
use super::values::stated;
use crate::import::keras::config::{Layer, Operand};
use crate::import::shapes;
use crate::{Activation, NetworkError, Op};

impl Import<'_> {
    pub(super) fn operation(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<usize, NetworkError> {
        let arithmetic = ["Add", "Subtract", "Multiply", "Divide", "TrueDivide"];
        if !arithmetic.contains(&layer.class) {
            return self.function(layer, from);
        }
        match layer.operands.as_slice() {
            [Operand::Layer(_), Operand::Layer(_)] => self.of_two(layer, [from[0], from[1]]),
            [Operand::Layer(_), Operand::Constant(shape, values)] => {
                self.with_constant(layer, from[0], shape, values, false)
            }
            [Operand::Constant(shape, values), Operand::Layer(_)] => {
                self.with_constant(layer, from[0], shape, values, true)
            }
            other => Err(NetworkError::unsupported(
                &layer.name,
                format!("{} of {} operands", layer.class, other.len()),
                "two work",
            )),
        }
    }

    fn of_two(&mut self, layer: &Layer<'_>, [a, b]: [usize; 2]) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let shapes = [a, b].map(|place| self.network.nodes[place].shape.clone());
        if shapes[0] != shapes[1] {
            return Err(NetworkError::unsupported(
                name,
                format!(
                    "{} of shapes {:?} and {:?}",
                    layer.class, shapes[0], shapes[1]
                ),
                "values of equal shape work",
            ));
        }
        match layer.class {
            "Add" => self.network.push(name, Op::Add, vec![a, b]),
            "Subtract" => {
                let channels = shapes[1].last().copied().unwrap_or(1);
                let op = Op::Scale {
                    gain: vec![-1.0; channels],
                    offset: vec![0.0; channels],
                };
                let b = self.push(&format!("{name} negative"), op, b)?;
                self.network.push(name, Op::Add, vec![a, b])
            }
            class => Err(NetworkError::unsupported(
                name,
                format!("{class} of two values"),
                "Add and Subtract work, and a constant on one side",
            )),
        }
    }

    /// `x op c`, or `c op x` where `reversed`.
    fn with_constant(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
        shape: &[usize],
        values: &[f32],
        reversed: bool,
    ) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let held = self.network.nodes[x].shape.clone();
        let c = shapes::spread(name, shape, values, &held)?;
        let map = |f: fn(f32) -> f32| c.iter().copied().map(f).collect::<Vec<f32>>();
        let (ones, zeros) = (vec![1.0; c.len()], vec![0.0; c.len()]);
        let (gain, offset) = match (layer.class, reversed) {
            ("Add", _) => (ones, c),
            ("Subtract", false) => (ones, map(|c| -c)),
            ("Subtract", true) => (vec![-1.0; c.len()], c),
            ("Multiply", _) => (c, zeros),
            ("Divide" | "TrueDivide", false) => (map(|c| 1.0 / c), zeros),
            _ => {
                return Err(NetworkError::unsupported(
                    name,
                    "division by a value",
                    "multiply by a constant",
                ));
            }
        };
        let per_channel = held.last() == Some(&gain.len());
        if per_channel {
            return self.push(name, Op::Scale { gain, offset }, x);
        }
        let flat = self.push(&format!("{name} flat"), Op::Reshape(vec![gain.len()]), x)?;
        let scaled = self.push(&format!("{name} scale"), Op::Scale { gain, offset }, flat)?;
        self.push(name, Op::Reshape(held), scaled)
    }

    /// An operation of one value.
    fn function(&mut self, layer: &Layer<'_>, from: &[usize]) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let &[x] = from else {
            return Err(NetworkError::unsupported(
                name,
                format!("the operation {} of {} values", layer.class, from.len()),
                "Add and Subtract of two values work",
            ));
        };
        if layer.operands.len() != 1 {
            return Err(NetworkError::unsupported(
                name,
                format!("the operation {} with a constant", layer.class),
                "Add, Subtract, Multiply and Divide with a constant work",
            ));
        }
        let number = |key: &str, otherwise: f32| -> Result<f32, NetworkError> {
            Ok(stated(name, key, &config[key])?.unwrap_or(otherwise))
        };
        let g = match layer.class {
            "Relu" => Activation::Relu,
            "Sigmoid" => Activation::Sigmoid,
            "Tanh" => Activation::Tanh,
            "Softplus" => Activation::Softplus,
            "Softsign" => Activation::Softsign,
            "Silu" => Activation::Swish,
            "Selu" => Activation::SELU,
            "Exp" => Activation::Exponential,
            "HardSigmoid" => Activation::HardSigmoid {
                alpha: 1.0 / 6.0,
                beta: 0.5,
            },
            "Elu" => Activation::Elu {
                alpha: number("alpha", 1.0)?,
                scale: 1.0,
            },
            "LeakyRelu" => Activation::LeakyRelu {
                alpha: number("negative_slope", 0.2)?,
            },
            "Negative" => {
                let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
                let op = Op::Scale {
                    gain: vec![-1.0; channels],
                    offset: vec![0.0; channels],
                };
                return self.push(name, op, x);
            }
            "Softmax" => {
                self.expect_last_axis(layer, &config["axis"], x)?;
                return self.push(name, Op::Softmax, x);
            }
            other => {
                return Err(NetworkError::unsupported(
                    name,
                    format!("the operation {other} of Keras"),
                    "write it as a layer",
                ));
            }
        };
        self.push(name, Op::Activation(g), x)
    }
}
