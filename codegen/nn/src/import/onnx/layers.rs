//! Operators of ONNX as nodes of the network.

use super::{Import, Node, Value, rotated};
use crate::import::keras::normalise;
use crate::import::{pads, shapes, tensor::Tensor};
use crate::{Activation, Convolution, Dense, NetworkError, Op, Pool, PoolKind, Window};

/// Operators that are known not to work, and what is nearest.
const NEAREST: &[(&str, &str)] = &[
    ("ConvTranspose", "the nearest is Conv"),
    ("Clip", "the nearest is Relu"),
    ("HardSwish", "the nearest is x * Sigmoid(x)"),
    ("Mish", "the nearest is x * Sigmoid(x)"),
    ("PRelu", "the nearest is LeakyRelu"),
    ("ThresholdedRelu", "the nearest is Relu"),
    ("LogSoftmax", "the nearest is Softmax"),
    ("LayerNormalization", "the nearest is BatchNormalization"),
    ("InstanceNormalization", "the nearest is BatchNormalization"),
    ("ReduceMean", "the nearest is GlobalAveragePool"),
    ("Slice", "give the network only the inputs that it reads"),
    ("Gather", "give the network only the inputs that it reads"),
    ("Pad", "use the pads of Conv"),
    ("Resize", "the nearest is a Conv with strides"),
    (
        "QLinearConv",
        "export float32 weights; int8 is an option of the emitter",
    ),
    (
        "QLinearMatMul",
        "export float32 weights; int8 is an option of the emitter",
    ),
    (
        "QuantizeLinear",
        "export float32 weights; int8 is an option of the emitter",
    ),
    ("Attention", "the nearest is GRU"),
];

impl Import<'_> {
    /// The outputs of a node.
    pub(super) fn node(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let op = node.proto.op_type.as_str();
        match op {
            "Identity" | "Dropout" => Ok(vec![self.value(node, 0)?]),
            "Relu" => self.activation(node, Activation::Relu),
            "Sigmoid" => self.activation(node, Activation::Sigmoid),
            "Tanh" => self.activation(node, Activation::Tanh),
            "Softplus" => self.activation(node, Activation::Softplus),
            "Softsign" => self.activation(node, Activation::Softsign),
            "Exp" => self.activation(node, Activation::Exponential),
            "LeakyRelu" => {
                let alpha = node.float("alpha", 0.01);
                self.activation(node, Activation::LeakyRelu { alpha })
            }
            "Elu" => {
                let alpha = node.float("alpha", 1.0);
                self.activation(node, Activation::Elu { alpha, scale: 1.0 })
            }
            "Selu" => {
                let (alpha, scale) = (
                    node.float("alpha", 1.673_263_2),
                    node.float("gamma", 1.050_701),
                );
                self.activation(node, Activation::Elu { alpha, scale })
            }
            "HardSigmoid" => {
                let (alpha, beta) = (node.float("alpha", 0.2), node.float("beta", 0.5));
                self.activation(node, Activation::HardSigmoid { alpha, beta })
            }
            "Gelu" => {
                let tanh = node.text("approximate") == "tanh";
                self.activation(
                    node,
                    if tanh {
                        Activation::GeluTanh
                    } else {
                        Activation::Gelu
                    },
                )
            }
            "Swish" => self.activation(node, Activation::Swish),
            "Softmax" => self.softmax(node),
            "Gemm" => self.gemm(node),
            "MatMul" => self.matmul(node),
            "Add" | "Sub" | "Mul" | "Div" | "Erf" | "Sum" => self.arithmetic(node),
            "Conv" => self.conv(node),
            "MaxPool" | "AveragePool" => self.pool(node),
            "GlobalMaxPool" | "GlobalAveragePool" => self.global_pool(node),
            "BatchNormalization" => self.batch_norm(node),
            "Concat" => self.concat(node),
            "Flatten" => self.flatten(node),
            "Reshape" => self.reshape(node),
            "Squeeze" | "Unsqueeze" => self.squeeze(node),
            "Transpose" => self.transpose(node),
            "RNN" | "GRU" | "LSTM" => self.recurrent(node),
            other => {
                let nearest = NEAREST.iter().find(|(name, _)| *name == other);
                let nearest = nearest.map_or(
                    "see docs/reference/networks.md for the operators that are",
                    |(_, n)| n,
                );
                Err(node.unsupported(format!("the operator {other}"), nearest))
            }
        }
    }

    fn softmax(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let axes = value.shape.len() as i64 + 1;
        let axis = node.int("axis", -1);
        if axis != -1 && axis != axes - 1 {
            return Err(node.unsupported(format!("axis {axis}"), "use the last axis, -1"));
        }
        let value = self.as_written(node, value)?;
        let place = self.push(node, Op::Softmax, value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    /// `W x + b` for `weights` of shape `[outputs][inputs]`.
    fn dense(
        &mut self,
        node: &Node<'_>,
        weights: Tensor,
        bias: Vec<f32>,
    ) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let outputs = bias.len();
        let mut shape = value.shape.clone();
        let Some(last) = shape.last_mut() else {
            return Err(node.malformed("it reads a value without axes"));
        };
        *last = outputs;
        let weights = weights.values;
        let rows: usize = shape.iter().rev().skip(1).product();
        let op = if rows == 1 {
            Op::Dense(Dense { weights, bias })
        } else {
            let window = Window {
                size: [1; 2],
                stride: [1; 2],
                dilation: [1; 2],
                before: [0; 2],
                after: [0; 2],
            };
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            })
        };
        let place = self.push(node, op, value.place)?;
        Ok(vec![Value {
            place,
            shape,
            ..value
        }])
    }

    fn gemm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        node.expect_int("transA", 0, "use transA = 0")?;
        let (alpha, beta) = (node.float("alpha", 1.0), node.float("beta", 1.0));
        let mut weights = self.needed(node, 1)?.clone();
        weights.expect_axes(&node.name, 2)?;
        if node.int("transB", 0) == 0 {
            weights = weights.transposed(&node.name)?;
        }
        weights.values.iter_mut().for_each(|w| *w *= alpha);
        let outputs = weights.shape[0];
        let bias = match self.weights(node, 2)? {
            None => vec![0.0; outputs],
            Some(bias) if bias.values.len() == outputs => {
                bias.values.iter().map(|b| beta * b).collect()
            }
            Some(bias) if bias.values.len() == 1 => vec![beta * bias.values[0]; outputs],
            Some(bias) => {
                return Err(node.malformed(format!(
                    "bias of shape {:?} for {outputs} outputs",
                    bias.shape
                )));
            }
        };
        self.dense(node, weights, bias)
    }

    fn matmul(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let weights = self.needed(node, 1)?.transposed(&node.name)?;
        let bias = vec![0.0; weights.shape[0]];
        self.dense(node, weights, bias)
    }

    /// Rows and columns of an image and its channels last; the value has channels first.
    fn image(&mut self, node: &Node<'_>) -> Result<(Value, [usize; 2]), NetworkError> {
        let value = self.value(node, 0)?;
        let size = match *value.shape.as_slice() {
            [_, columns] => [1, columns],
            [_, rows, columns] => [rows, columns],
            _ => {
                let message = format!(
                    "{} of an image of shape {:?}",
                    node.proto.op_type, value.shape
                );
                return Err(node.unsupported(message, "one and two dimensions work"));
            }
        };
        Ok((self.channels_last(node, value)?, size))
    }

    fn window(
        &self,
        node: &Node<'_>,
        image: [usize; 2],
        size: [usize; 2],
        one: bool,
    ) -> Result<Window, NetworkError> {
        let bounded =
            |n: i64| usize::try_from(n).map_err(|_| node.malformed(format!("{n} in its window")));
        let pair = |name: &str| -> Result<[usize; 2], NetworkError> {
            Ok(match node.ints(name) {
                Some(&[columns]) if one => [1, bounded(columns)?],
                Some(&[rows, columns]) if !one => [bounded(rows)?, bounded(columns)?],
                None => [1, 1],
                Some(other) => return Err(node.malformed(format!("{name} is {other:?}"))),
            })
        };
        let (stride, dilation) = (pair("strides")?, pair("dilations")?);
        let mut window = Window {
            size,
            stride,
            dilation,
            before: [0; 2],
            after: [0; 2],
        };
        match node.text("auto_pad").as_str() {
            "" | "NOTSET" => match node.ints("pads") {
                None => {}
                Some(&[before, after]) if one => {
                    (window.before[1], window.after[1]) = (bounded(before)?, bounded(after)?);
                }
                Some(&[top, left, bottom, right]) if !one => {
                    window.before = [bounded(top)?, bounded(left)?];
                    window.after = [bounded(bottom)?, bounded(right)?];
                }
                Some(other) => return Err(node.malformed(format!("pads is {other:?}"))),
            },
            "VALID" => {}
            "SAME_UPPER" => {
                for axis in 0..2 {
                    let (before, after) =
                        pads::same(image[axis], size[axis], stride[axis], dilation[axis]);
                    (window.before[axis], window.after[axis]) = (before, after);
                }
            }
            other => {
                return Err(
                    node.unsupported(format!("auto_pad {other:?}"), "use SAME_UPPER or pads")
                );
            }
        }
        Ok(window)
    }

    fn conv(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        node.expect_int("group", 1, "use group = 1")?;
        let (value, image) = self.image(node)?;
        let one = value.shape.len() == 2;
        let weights = self.needed(node, 1)?;
        weights.expect_axes(&node.name, if one { 3 } else { 4 })?;
        let (size, order): (_, &[usize]) = if one {
            ([1, weights.shape[2]], &[0, 2, 1])
        } else {
            ([weights.shape[2], weights.shape[3]], &[0, 2, 3, 1])
        };
        let window = self.window(node, image, size, one)?;
        let filters = weights.shape[0];
        let bias = match self.weights(node, 2)? {
            Some(bias) => {
                bias.expect_shape(&node.name, &[filters])?;
                bias.values.clone()
            }
            None => vec![0.0; filters],
        };
        let weights = weights.permuted(order).values;
        self.image_layer(
            node,
            &value,
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            }),
        )
    }

    /// A layer whose result is an image with channels last.
    fn image_layer(
        &mut self,
        node: &Node<'_>,
        value: &Value,
        op: Op,
    ) -> Result<Vec<Value>, NetworkError> {
        let place = self.push(node, op, value.place)?;
        let held = &self.network.nodes[place].shape;
        let channels = held.len() - 1;
        let shape = [&held[channels..], &held[..channels]].concat();
        Ok(vec![Value {
            place,
            shape,
            batch: 0,
            last: true,
            gelu: None,
        }])
    }

    fn pool(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        node.expect_int("ceil_mode", 0, "use ceil_mode = 0")?;
        let (value, image) = self.image(node)?;
        let one = value.shape.len() == 2;
        let size = |n: i64| usize::try_from(n).unwrap_or(0);
        let size = match node.ints("kernel_shape") {
            Some(&[columns]) if one => [1, size(columns)],
            Some(&[rows, columns]) if !one => [size(rows), size(columns)],
            other => return Err(node.malformed(format!("kernel_shape is {other:?}"))),
        };
        let window = self.window(node, image, size, one)?;
        let kind = match (
            node.proto.op_type.as_str(),
            node.int("count_include_pad", 0),
        ) {
            ("MaxPool", _) => PoolKind::Max,
            (_, 0) => PoolKind::Average,
            _ => PoolKind::AverageWithPadding,
        };
        self.image_layer(node, &value, Op::Pool(Pool { window, kind }))
    }

    fn global_pool(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let (value, size) = self.image(node)?;
        let window = Window {
            size,
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let max = node.proto.op_type == "GlobalMaxPool";
        let kind = if max {
            PoolKind::Max
        } else {
            PoolKind::Average
        };
        self.image_layer(node, &value, Op::Pool(Pool { window, kind }))
    }

    fn batch_norm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.channels_last(node, value)?;
        let channels = value.shape.first().copied().unwrap_or(0);
        let mut lists = Vec::new();
        for input in 1..5 {
            let tensor = self.needed(node, input)?;
            tensor.expect_shape(&node.name, &[channels])?;
            lists.push(tensor.values.clone());
        }
        let op = normalise(
            [&lists[0], &lists[1], &lists[2], &lists[3]],
            node.float("epsilon", 1e-5).into(),
        );
        let place = self.push(node, op, value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    fn concat(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let mut values = Vec::new();
        for input in 0..node.proto.input.len() {
            let value = self.value(node, input)?;
            values.push(value);
        }
        let last = values.iter().any(|value| value.last);
        let mut parts = Vec::new();
        for value in values {
            parts.push(if last {
                self.channels_last(node, value)?
            } else {
                self.as_written(node, value)?
            });
        }
        let first = parts
            .first()
            .cloned()
            .ok_or_else(|| node.malformed("it reads nothing"))?;
        let axis = inner_axis(node, node.int("axis", 0), &first)?;
        let axes = first.shape.len();
        let held = if first.last {
            (axis + axes - 1) % axes
        } else {
            axis
        };
        let name = self.free_name(&node.name);
        let from = parts.iter().map(|part| part.place).collect();
        let place = self.network.push(&name, Op::Concatenate(held), from)?;
        let mut shape = first.shape.clone();
        shape[axis] = parts
            .iter()
            .map(|part| part.shape.get(axis).copied().unwrap_or(0))
            .sum();
        Ok(vec![Value {
            place,
            shape,
            ..first
        }])
    }

    fn flatten(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        node.expect_int("axis", 1, "use axis = 1")?;
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let length = self.network.nodes[value.place].len();
        let place = self.push(node, Op::Reshape(vec![length]), value.place)?;
        Ok(vec![Value {
            place,
            shape: vec![length],
            batch: 0,
            last: false,
            gelu: None,
        }])
    }

    fn reshape(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let target = self.integers(node, 1, "shape");
        let target = target
            .ok_or_else(|| node.unsupported("a shape that is computed", "use a constant shape"))?;
        // 0 stands for the axis as it is.
        let full: Vec<i64> = with_batch(&value).iter().map(|&n| n as i64).collect();
        let target: Vec<i64> = (target.iter().enumerate())
            .map(|(axis, &n)| {
                if n == 0 {
                    full.get(axis).copied().unwrap_or(0)
                } else {
                    n
                }
            })
            .collect();
        let length = self.network.nodes[value.place].len();
        let [_, inner @ ..] = target.as_slice() else {
            return Err(node.malformed("a shape without axes"));
        };
        if inner.is_empty() {
            return Err(node.unsupported(
                "a shape without the batch",
                "keep the batch as the first axis",
            ));
        }
        // Where the first axis is open it is the batch, 1.
        let open = target
            .iter()
            .map(|&n| if n == 0 { -1 } else { n })
            .collect::<Vec<_>>();
        let shape = shapes::open(&node.name, &open, length)?;
        if shape[0] != 1 {
            return Err(node.unsupported(
                format!("the shape {target:?}"),
                "keep the batch, 1, as the first axis",
            ));
        }
        let place = self.push(node, Op::Reshape(shape[1..].to_vec()), value.place)?;
        Ok(vec![Value {
            place,
            shape: shape[1..].to_vec(),
            batch: 0,
            last: false,
            gelu: None,
        }])
    }

    fn squeeze(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let mut full: Vec<(usize, bool)> = (with_batch(&value).into_iter().enumerate())
            .map(|(axis, n)| (n, axis == value.batch))
            .collect();
        let axes = self.integers(node, 1, "axes");
        let axes = axes.ok_or_else(|| node.unsupported("squeezing every axis", "name the axes"))?;
        let out = node.proto.op_type == "Unsqueeze";
        let count = if out {
            full.len() + axes.len()
        } else {
            full.len()
        } as i64;
        let mut places: Vec<i64> = axes
            .iter()
            .map(|&a| if a < 0 { a + count } else { a })
            .collect();
        places.sort_unstable();
        if places.iter().any(|place| !(0..count).contains(place)) {
            return Err(node.malformed(format!("axes {axes:?} of {count}")));
        }
        if out {
            for place in places {
                full.insert(place as usize, (1, false));
            }
        } else {
            for place in places.into_iter().rev() {
                let (n, batch) = full.remove(place as usize);
                if n != 1 || batch {
                    return Err(
                        node.unsupported(format!("squeezing axis {place}"), "keep the batch")
                    );
                }
            }
        }
        let batch = full.iter().position(|(_, batch)| *batch).unwrap_or(0);
        let shape: Vec<usize> = full
            .into_iter()
            .filter(|(_, batch)| !batch)
            .map(|(n, _)| n)
            .collect();
        Ok(vec![Value {
            shape,
            batch,
            ..value
        }])
    }

    fn transpose(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let axes = value.shape.len() + 1;
        let order: Vec<usize> = match node.ints("perm") {
            Some(order) => order
                .iter()
                .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
                .collect(),
            None => (0..axes).rev().collect(),
        };
        let mut sorted = order.clone();
        sorted.sort_unstable();
        if sorted != (0..axes).collect::<Vec<_>>() {
            return Err(node.malformed(format!("perm is {order:?}")));
        }
        let batch = order
            .iter()
            .position(|&axis| axis == value.batch)
            .unwrap_or(0);
        let inner: Vec<usize> = (order.iter().filter(|&&axis| axis != value.batch))
            .map(|&axis| if axis > value.batch { axis - 1 } else { axis })
            .collect();
        let place = self.push(node, Op::Permute(inner.clone()), value.place)?;
        let shape = inner.iter().map(|&axis| value.shape[axis]).collect();
        Ok(vec![Value {
            place,
            shape,
            batch,
            last: false,
            gelu: None,
        }])
    }
}

/// The shape as ONNX has it.
fn with_batch(value: &Value) -> Vec<usize> {
    let mut shape = value.shape.clone();
    shape.insert(value.batch.min(shape.len()), 1);
    shape
}

/// An axis of ONNX's shape without the batch.
fn inner_axis(node: &Node<'_>, axis: i64, value: &Value) -> Result<usize, NetworkError> {
    let axes = value.shape.len() as i64 + 1;
    let place = if axis < 0 { axis + axes } else { axis };
    let batch = value.batch as i64;
    if !(0..axes).contains(&place) || place == batch {
        return Err(node.malformed(format!(
            "axis {axis} of {axes}, of which {batch} is the batch"
        )));
    }
    Ok(usize::try_from(if place > batch { place - 1 } else { place }).unwrap_or(0))
}

/// The one place along which a constant varies, as offsets of a value's last axis as it is held.
pub(super) fn spread(
    node: &Node<'_>,
    constant: &Tensor,
    value: &Value,
) -> Result<Vec<f32>, NetworkError> {
    let held = if value.last {
        rotated(&value.shape)
    } else {
        value.shape.clone()
    };
    let channels = held.last().copied().unwrap_or(1);
    if constant.values.len() == 1 {
        return Ok(vec![constant.values[0]; channels]);
    }
    // Aligned at the end, as ONNX does; the varying axis has to be the one held last.
    let full = with_batch(value);
    let channel_axis = if value.last { 1 } else { full.len() - 1 };
    let lead = full.len().checked_sub(constant.shape.len());
    let only_there = lead.is_some_and(|lead| {
        constant
            .shape
            .iter()
            .enumerate()
            .all(|(axis, &n)| n == 1 || (axis + lead == channel_axis && n == channels))
    });
    if only_there && constant.values.len() == channels {
        return Ok(constant.values.clone());
    }
    Err(node.unsupported(
        format!("a constant of shape {:?} beside {full:?}", constant.shape),
        "one number for each channel works",
    ))
}
