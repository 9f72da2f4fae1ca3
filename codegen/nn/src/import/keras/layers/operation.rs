//! Operations of Keras 3: what `keras.ops` and the operators of Python leave in a functional model.

use super::Import;
use super::reductions::REDUCTIONS;
use super::values::stated;
use crate::import::keras::config::{Layer, Operand};
use crate::import::shapes;
use crate::{Activation, NetworkError, Op};

/// Operations of two operands, of which one may be a constant.
const OF_TWO: &[&str] = &[
    "Add",
    "Subtract",
    "Multiply",
    "Divide",
    "TrueDivide",
    "Maximum",
    "Minimum",
    "Power",
];

/// Operations that work besides those of two operands and over one axis.
const WORKING: &str = "Abs, Clip, Concatenate, Exp, Flip, GetItem, Log, LogSoftmax, Matmul with a \
                       constant, Normalize, Reciprocal, Reshape, Rsqrt, Softmax, Split, Sqrt, \
                       Square, Swapaxes, Transpose and the activations of layers";

impl Import<'_> {
    pub(super) fn operation(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<usize, NetworkError> {
        if !OF_TWO.contains(&layer.class) {
            return match layer.class {
                class if REDUCTIONS.contains(&class) && from.len() == 1 => {
                    self.reduced(layer, from[0])
                }
                "Matmul" | "Dot" => self.product(layer, from[0]),
                _ => self.function(layer, from),
            };
        }
        match layer.operands.as_slice() {
            [Operand::Layer(_), Operand::Layer(_)] => self.of_values(layer, from),
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

    /// The sum, product, mean, largest or smallest of values, a difference or a quotient of two.
    pub(super) fn of_values(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let from = self.network.alike(name, from)?;
        if let (&[a, b], "Subtract" | "Divide" | "TrueDivide") = (from.as_slice(), layer.class) {
            return match layer.class {
                "Subtract" => self.network.difference(name, a, b),
                _ => self.network.quotient(name, a, b),
            };
        }
        let Some((&first, others)) = from.split_first() else {
            return Err(NetworkError::malformed(name, "it reads nothing"));
        };
        let network = &mut self.network;
        let mut others = others.iter();
        match layer.class {
            "Add" => network.append(name, Op::Add, &from),
            "Average" => {
                let sum = network.append(name, Op::Add, &from)?;
                network.scaled(name, sum, 1.0 / from.len() as f32, 0.0)
            }
            "Multiply" => others.try_fold(first, |product, &other| {
                network.append(name, Op::Multiply, &[product, other])
            }),
            "Maximum" => others.try_fold(first, |most, &other| network.larger(name, most, other)),
            "Minimum" => {
                others.try_fold(first, |least, &other| network.smaller(name, least, other))
            }
            class => Err(NetworkError::unsupported(
                name,
                format!("{class} of {} values", from.len()),
                "Add, Subtract, Multiply, Divide, Average, Maximum and Minimum work",
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
        let single = c.iter().all(|&other| Some(&other) == c.first());
        let (gain, offset) = match (layer.class, reversed) {
            ("Add", _) => (ones, c),
            ("Subtract", false) => (ones, map(|c| -c)),
            ("Subtract", true) => (vec![-1.0; c.len()], c),
            ("Multiply", _) => (c, zeros),
            ("Divide" | "TrueDivide", false) => (map(|c| 1.0 / c), zeros),
            ("Divide" | "TrueDivide", true) => {
                let g = Op::Activation(Activation::Reciprocal);
                let inverse = self.network.append(name, g, &[x])?;
                return self.network.of_each(name, inverse, c, zeros);
            }
            ("Power", false) if single => {
                return self
                    .network
                    .power(name, x, c.first().copied().unwrap_or(1.0));
            }
            ("Maximum" | "Minimum", _) => {
                let largest = layer.class == "Maximum";
                return self.network.bounded_each(name, x, &c, largest);
            }
            (class, _) => {
                return Err(NetworkError::unsupported(
                    name,
                    format!("{class} of a constant and a value"),
                    "a power with one constant exponent works",
                ));
            }
        };
        self.network.of_each(name, x, gain, offset)
    }

    /// An operation of one value.
    fn function(&mut self, layer: &Layer<'_>, from: &[usize]) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let constants = layer.operands.iter();
        if constants
            .filter(|o| !matches!(o, Operand::Layer(_)))
            .count()
            > 0
        {
            return Err(NetworkError::unsupported(
                name,
                format!("the operation {} with a constant", layer.class),
                format!("{} and Matmul with a constant work", OF_TWO.join(", ")),
            ));
        }
        if from.len() > 1 && layer.class != "Concatenate" {
            return Err(NetworkError::unsupported(
                name,
                format!("the operation {} of {} values", layer.class, from.len()),
                "Add, Subtract, Multiply, Divide, Maximum and Minimum of two values work",
            ));
        }
        if let Some(place) = self.moved(layer, from)? {
            return Ok(place);
        }
        let x = from[0];
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
            "Log" => Activation::Logarithm,
            "Sqrt" => Activation::Root,
            "Reciprocal" => Activation::Reciprocal,
            "Gelu" if config["approximate"].as_bool() == Some(false) => Activation::Gelu,
            "Gelu" => Activation::GeluTanh,
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
            "Negative" => return self.network.scaled(name, x, -1.0, 0.0),
            "Absolute" | "Abs" => return self.network.absolute(name, x),
            "Square" => return self.network.power(name, x, 2.0),
            "Relu6" => return self.network.clipped(name, x, 0.0, 6.0),
            "HardTanh" => return self.network.clipped(name, x, -1.0, 1.0),
            "HardSilu" => return self.network.hard_swish(name, x),
            "LogSigmoid" => return self.network.log_sigmoid(name, x),
            "Mish" => return self.network.mish(name, x),
            "Celu" => {
                let alpha = number("alpha", 1.0)?;
                return self.network.celu(name, x, alpha);
            }
            "Clip" => {
                let (low, high) = (number("x_min", f32::MIN)?, number("x_max", f32::MAX)?);
                return self.network.clipped(name, x, low, high);
            }
            "Cast" => return self.cast(layer, x),
            "Rsqrt" => return self.network.power(name, x, -0.5),
            "SoftShrink" => {
                let threshold = number("threshold", 0.5)?;
                return self.network.soft_shrink(name, x, threshold);
            }
            "Squareplus" => {
                let b = number("b", 4.0)?;
                return self.network.squareplus(name, x, b);
            }
            "SparsePlus" => return self.network.sparse_plus(name, x),
            "TanhShrink" => return self.network.tanh_shrink(name, x),
            "SparseSigmoid" => Activation::HardSigmoid {
                alpha: 0.5,
                beta: 0.5,
            },
            "Normalize" => {
                if config["order"].as_u64() != Some(2) {
                    let what = format!("Normalize of order {}", config["order"]);
                    return Err(NetworkError::unsupported(name, what, "order 2 works"));
                }
                let least = number("epsilon", 1e-7)?;
                return self.of_unit_length(layer, x, least * least);
            }
            "Softmax" => return self.softmax(layer, Op::Softmax, x),
            "LogSoftmax" => return self.softmax(layer, Op::LogSoftmax, x),
            other => {
                return Err(NetworkError::unsupported(
                    name,
                    format!("the operation {other} of Keras"),
                    format!(
                        "these work: {}, {}, {WORKING}",
                        OF_TWO.join(", "),
                        REDUCTIONS.join(", ")
                    ),
                ));
            }
        };
        self.push(name, Op::Activation(g), x)
    }

    /// A cast to the type that it is computed in here.
    fn cast(&self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        match &layer.config["dtype"] {
            to if ["float32", "float64"].map(Some).contains(&to.as_str()) => Ok(x),
            to => Err(NetworkError::unsupported(
                &layer.name,
                format!("a Cast to {to}"),
                "float32 works",
            )),
        }
    }
}
