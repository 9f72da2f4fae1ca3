//! TensorFlow Lite: float32 and float16, and int8 with its weights dequantised. Values between layers are
//! floating point here, so a quantised file gives what its weights say, without the rounding of its values.

mod file;
mod flatbuffer;
mod recurrent;

use std::collections::HashMap;

use super::pads;
use super::tensor::Tensor;
use crate::{Activation, Convolution, Dense, Network, NetworkError, Op, Pool, PoolKind, Window};
use file::{Model, Operator};

/// Operators that are known not to work: code, name and what is nearest.
const NEAREST: &[(i32, &str, &str)] = &[
    (4, "DEPTHWISE_CONV_2D", "use Conv2D"),
    (21, "RELU6", "use ReLU"),
    (34, "PAD", "use padding='same' in the convolution"),
    (67, "TRANSPOSE_CONV", "use Conv2D"),
    (117, "HARD_SWISH", "use swish"),
];

struct Import<'a> {
    network: Network,
    model: &'a Model<'a>,
    /// The node that holds each tensor.
    places: HashMap<i32, usize>,
}

/// # Errors
/// [`NetworkError`].
pub(super) fn import(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    let model = Model::new(bytes)?;
    recurrent::refuse(&model)?;
    if model.graphs > 1 {
        return Err(NetworkError::unsupported(
            "model",
            format!("{} graphs", model.graphs),
            "convert a model without loops or branches that depend on values",
        ));
    }
    let one = |list: &[i32], what: &str| match *list {
        [one] => Ok(one),
        _ => Err(NetworkError::unsupported(
            "model",
            format!("{} {what}s", list.len()),
            format!("concatenate the {what}s into one"),
        )),
    };
    let (input, output) = (one(&model.inputs, "input")?, one(&model.outputs, "output")?);
    let info = tensor(&model, input)?;
    let shape = info.shape.get(1..).unwrap_or(&[]).to_vec();
    let input_name = if info.name.is_empty() {
        "input"
    } else {
        &info.name
    };
    let mut import = Import {
        network: Network::new(name, input_name, shape),
        model: &model,
        places: HashMap::from([(input, 0)]),
    };
    for operator in &model.operators {
        import.operator(operator)?;
    }
    let place = import.places.get(&output).copied();
    let place =
        place.ok_or_else(|| NetworkError::malformed("model", "no operator gives the output"))?;
    let mut network = import.network;
    network.nodes.truncate(place + 1);
    network.drop_unread();
    Ok(network)
}

fn tensor<'a>(model: &'a Model<'_>, index: i32) -> Result<&'a file::TensorInfo, NetworkError> {
    let found = usize::try_from(index)
        .ok()
        .and_then(|index| model.tensors.get(index));
    found.ok_or_else(|| NetworkError::malformed("model", format!("there is no tensor {index}")))
}

/// Names of fused layers are joined by `;`, the last being that of the layer.
fn last(name: &str) -> &str {
    name.rsplit(';').next().unwrap_or(name)
}

impl Import<'_> {
    fn operator(&mut self, operator: &Operator<'_>) -> Result<(), NetworkError> {
        let Some(&output) = operator.outputs.first() else {
            return Err(NetworkError::malformed(
                "model",
                "an operator without output",
            ));
        };
        let info = tensor(self.model, output)?;
        let name = self.free_name(&info.name);
        let option = |id: usize| operator.options.map_or(Ok(0), |options| options.byte(id));
        let place = match operator.code {
            0 => {
                let sum = self.sum(operator, &name, [1.0, 1.0])?;
                self.fused(&name, sum, option(0)?)?
            }
            41 => {
                let sum = self.sum(operator, &name, [1.0, -1.0])?;
                self.fused(&name, sum, option(0)?)?
            }
            18 => {
                let product = self.product(operator, &name)?;
                self.fused(&name, product, option(0)?)?
            }
            1 | 17 => {
                let kind = if operator.code == 17 {
                    PoolKind::Max
                } else {
                    PoolKind::Average
                };
                let (x, window) = self.pool(operator, &name)?;
                let place = self
                    .network
                    .push(&name, Op::Pool(Pool { window, kind }), vec![x])?;
                self.fused(&name, place, option(5)?)?
            }
            2 => {
                let axis = operator
                    .options
                    .map_or(Ok(0), |options| options.int(0, 0))?;
                let place = self.concatenate(operator, &name, axis)?;
                self.fused(&name, place, option(1)?)?
            }
            3 => {
                let place = self.convolution(operator, &name)?;
                self.fused(&name, place, option(3)?)?
            }
            9 => {
                let place = self.dense(operator, &name)?;
                self.fused(&name, place, option(0)?)?
            }
            40 => self.mean(operator, &name)?,
            // A weight that is only widened, or a value that is only requantised, stays itself.
            6 | 114 => {
                let input = operator.inputs.first().copied().unwrap_or(-1);
                match self.places.get(&input) {
                    Some(&place) => place,
                    None => return Ok(()),
                }
            }
            22 | 43 | 70 => {
                let x = self.value(operator, 0, &name)?;
                let shape = info.shape.get(1..).unwrap_or(&[]).to_vec();
                let shape = if shape.is_empty() {
                    vec![self.network.nodes[x].len()]
                } else {
                    shape
                };
                self.network.push(&name, Op::Reshape(shape), vec![x])?
            }
            // They compute the shape of a reshape, which its result has.
            45 | 77 | 83 => return Ok(()),
            25 => {
                let beta = operator
                    .options
                    .map_or(Ok(1.0), |options| options.float(0, 1.0))?;
                if beta != 1.0 {
                    return Err(NetworkError::unsupported(
                        name,
                        format!("a softmax of beta {beta}"),
                        "use beta = 1",
                    ));
                }
                let x = self.value(operator, 0, &name)?;
                self.network.push(&name, Op::Softmax, vec![x])?
            }
            code => {
                let g = activation(code, operator, &name)?;
                let x = self.value(operator, 0, &name)?;
                self.network.push(&name, Op::Activation(g), vec![x])?
            }
        };
        self.places.insert(output, place);
        Ok(())
    }

    fn free_name(&self, name: &str) -> String {
        let name = if name.is_empty() { "layer" } else { last(name) };
        let taken = |name: &str| self.network.nodes.iter().any(|node| node.name == name);
        let mut free: String = name.chars().filter(|c| !c.is_control()).take(200).collect();
        let mut number = 2;
        while taken(&free) {
            free = format!("{name} {number}");
            number += 1;
        }
        free
    }

    /// The node at an input.
    fn value(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let index = operator.inputs.get(input).copied().unwrap_or(-1);
        self.places.get(&index).copied().ok_or_else(|| {
            NetworkError::malformed(
                name,
                format!("it reads tensor {index}, which no operator before it gives"),
            )
        })
    }

    /// The weights at an input, also where they are widened first.
    fn constant(
        &self,
        operator: &Operator<'_>,
        input: usize,
    ) -> Result<Option<&Tensor>, NetworkError> {
        let Some(&index) = operator.inputs.get(input).filter(|&&index| index >= 0) else {
            return Ok(None);
        };
        let info = tensor(self.model, index)?;
        if info.constant.is_some() {
            return Ok(info.constant.as_ref());
        }
        let widened = self
            .model
            .operators
            .iter()
            .find(|o| o.code == 6 && o.outputs.first() == Some(&index));
        match widened.and_then(|operator| operator.inputs.first()) {
            Some(&source) => Ok(tensor(self.model, source)?.constant.as_ref()),
            None => Ok(None),
        }
    }

    fn weights(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<&Tensor, NetworkError> {
        self.constant(operator, input)?.ok_or_else(|| {
            NetworkError::unsupported(name, "weights that are computed", "convert a trained model")
        })
    }

    fn bias(
        &self,
        operator: &Operator<'_>,
        count: usize,
        name: &str,
    ) -> Result<Vec<f32>, NetworkError> {
        match self.constant(operator, 2)? {
            Some(bias) => {
                bias.expect_shape(name, &[count])?;
                Ok(bias.values.clone())
            }
            None => Ok(vec![0.0; count]),
        }
    }

    /// The activation that an operator has within it.
    fn fused(&mut self, name: &str, place: usize, code: u8) -> Result<usize, NetworkError> {
        let g = match code {
            0 => return Ok(place),
            1 => Activation::Relu,
            4 => Activation::Tanh,
            other => {
                let what = format!("the activation {other} (ReLU6 is 3)");
                return Err(NetworkError::unsupported(name, what, "the nearest is ReLU"));
            }
        };
        let name = self.free_name(&format!("{name} activation"));
        self.network.push(&name, Op::Activation(g), vec![place])
    }

    fn dense(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 2)?;
        let bias = self.bias(operator, weights.shape[0], name)?;
        let weights = weights.values.clone();
        self.network
            .push(name, Op::Dense(Dense { weights, bias }), vec![x])
    }

    fn image(&self, x: usize, name: &str) -> Result<[usize; 2], NetworkError> {
        match *self.network.nodes[x].shape.as_slice() {
            [rows, columns, _] => Ok([rows, columns]),
            [columns, _] => Ok([1, columns]),
            ref other => Err(NetworkError::malformed(
                name,
                format!("{other:?} is no image"),
            )),
        }
    }

    fn window(
        &self,
        operator: &Operator<'_>,
        image: [usize; 2],
        size: [usize; 2],
        dilated: bool,
    ) -> Result<Window, NetworkError> {
        let Some(options) = operator.options else {
            return Err(NetworkError::malformed("model", "a window without options"));
        };
        let number = |id: usize, otherwise: i32| -> Result<usize, NetworkError> {
            Ok(usize::try_from(options.int(id, otherwise)?).unwrap_or(0))
        };
        let stride = [number(2, 0)?, number(1, 0)?];
        let dilation = if dilated {
            [number(5, 1)?, number(4, 1)?]
        } else {
            [1, 1]
        };
        let mut window = Window {
            size,
            stride,
            dilation,
            before: [0; 2],
            after: [0; 2],
        };
        if options.byte(0)? == 0 {
            for axis in 0..2 {
                let (before, after) =
                    pads::same(image[axis], size[axis], stride[axis], dilation[axis]);
                (window.before[axis], window.after[axis]) = (before, after);
            }
        }
        Ok(window)
    }

    fn convolution(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 4)?;
        let size = [weights.shape[1], weights.shape[2]];
        let window = self.window(operator, image, size, true)?;
        let bias = self.bias(operator, weights.shape[0], name)?;
        let weights = weights.values.clone();
        self.network.push(
            name,
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            }),
            vec![x],
        )
    }

    fn pool(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<(usize, Window), NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let number = |id: usize| operator.options.map_or(Ok(0), |options| options.int(id, 0));
        let size = [number(4)?, number(3)?].map(|n| usize::try_from(n).unwrap_or(0));
        Ok((x, self.window(operator, image, size, false)?))
    }

    /// The mean over the whole image.
    fn mean(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let size = self.image(x, name)?;
        let axes = &tensor(self.model, operator.inputs.get(1).copied().unwrap_or(-1))?.integers;
        let axes_of_image = self.network.nodes[x].shape.len() as i64;
        let expected: Vec<i64> = (1..axes_of_image).collect();
        if *axes != expected {
            return Err(NetworkError::unsupported(
                name,
                format!("a mean over the axes {axes:?}"),
                "the mean over a whole image works, GlobalAveragePooling2D",
            ));
        }
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let window = Window {
            size,
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let pool = Op::Pool(Pool {
            window,
            kind: PoolKind::Average,
        });
        let pool = self
            .network
            .push(&self.free_name(&format!("{name} pool")), pool, vec![x])?;
        self.network
            .push(name, Op::Reshape(vec![channels]), vec![pool])
    }

    /// Values added, or a value and weights; with the signs of both.
    fn sum(
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
            let op = Op::Scale {
                gain: vec![signs[value]; offset.len()],
                offset: offset.iter().map(|o| signs[weights] * o).collect(),
            };
            return self.network.push(name, op, vec![x]);
        }
        if signs != [1.0; 2] {
            return Err(NetworkError::unsupported(
                name,
                "SUB of two values",
                "use ADD",
            ));
        }
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<_, _>>()?;
        self.network.push(name, Op::Add, from)
    }

    /// A value and weights, or a value and its own sigmoid.
    fn product(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        for (value, weights) in [(0, 1), (1, 0)] {
            if let Some(constant) = self.constant(operator, weights)?.cloned() {
                let x = self.value(operator, value, name)?;
                let gain = self.spread(&constant, x, name)?;
                let offset = vec![0.0; gain.len()];
                return self.network.push(name, Op::Scale { gain, offset }, vec![x]);
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

    /// One number for each channel of a node.
    fn spread(&self, constant: &Tensor, x: usize, name: &str) -> Result<Vec<f32>, NetworkError> {
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        match constant.values.len() {
            1 => Ok(vec![constant.values[0]; channels]),
            n if n == channels && constant.shape.last() == Some(&channels) => {
                Ok(constant.values.clone())
            }
            _ => Err(NetworkError::unsupported(
                name,
                format!("a constant of shape {:?}", constant.shape),
                "one number for each channel works",
            )),
        }
    }

    fn concatenate(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
        axis: i32,
    ) -> Result<usize, NetworkError> {
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<Vec<_>, _>>()?;
        let axes = from
            .first()
            .map_or(0, |&x| self.network.nodes[x].shape.len());
        let place = if axis < 0 {
            axis + axes as i32
        } else {
            axis - 1
        };
        let place = usize::try_from(place).unwrap_or(usize::MAX);
        self.network.push(name, Op::Concatenate(place), from)
    }
}

fn activation(code: i32, operator: &Operator<'_>, name: &str) -> Result<Activation, NetworkError> {
    let options = operator.options;
    Ok(match code {
        14 => Activation::Sigmoid,
        19 => Activation::Relu,
        28 => Activation::Tanh,
        47 => Activation::Exponential,
        98 => Activation::LeakyRelu {
            alpha: options.map_or(Ok(0.0), |options| options.float(0, 0.0))?,
        },
        111 => Activation::Elu {
            alpha: 1.0,
            scale: 1.0,
        },
        150 if options.map_or(Ok(0), |options| options.byte(0))? != 0 => Activation::GeluTanh,
        150 => Activation::Gelu,
        other => {
            let known = NEAREST.iter().find(|(code, ..)| *code == other);
            let (what, nearest) = known.map_or(
                (
                    format!("the operator {other}"),
                    "see docs/reference/networks.md for the operators that are",
                ),
                |(_, name, nearest)| (format!("the operator {name}"), *nearest),
            );
            return Err(NetworkError::unsupported(name, what, nearest));
        }
    })
}
