//! Operators of ONNX as nodes of the network.

use super::constant::{Constant, DOUBLE, FLOAT, type_name};
use super::constants::{axis_of, gathered, reshape_target, slices, squeezed, transposition};
use super::{Import, Node, Value};
use crate::import::keras::normalise;
use crate::import::pads;
use crate::import::shapes::slice_indices;
use crate::import::tensor::{self, Tensor};
use crate::{Activation, Convolution, Dense, NetworkError, Op, Pool, PoolKind, Window};

/// Weights of a convolution in groups with its zeros between groups.
const MAX_UNGROUPED: usize = 65_536;

/// Operators that are known not to work, and what is nearest.
const NEAREST: &[(&str, &str)] = &[
    ("ConvTranspose", "the nearest is Conv"),
    ("HardSwish", "the nearest is x * Sigmoid(x)"),
    ("Mish", "the nearest is x * Sigmoid(x)"),
    ("PRelu", "the nearest is LeakyRelu"),
    ("ThresholdedRelu", "the nearest is Relu"),
    ("LogSoftmax", "the nearest is Softmax"),
    ("LayerNormalization", "the nearest is BatchNormalization"),
    ("InstanceNormalization", "the nearest is BatchNormalization"),
    ("Pad", "use the pads of Conv"),
    ("Pow", "the nearest is Relu or Softplus"),
    ("Sqrt", "the nearest is Relu"),
    ("Log", "the nearest is Softplus"),
    ("Einsum", "use MatMul with weights"),
    ("If", "export the branch that is taken"),
    ("Loop", "export an RNN, GRU or LSTM, or steps written out"),
    ("Scan", "export an RNN, GRU or LSTM, or steps written out"),
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
            "Identity" => Ok(vec![self.value(node, 0)?]),
            "Dropout" => {
                let training = self.integers(node, 2, "training_mode");
                if node.input(2).is_some()
                    && training.is_none_or(|list| list.iter().any(|&n| n != 0))
                {
                    return Err(node.unsupported("a Dropout in training", "export for inference"));
                }
                node.input(1);
                Ok(vec![self.value(node, 0)?])
            }
            "Cast" => self.cast(node),
            "Clip" => self.clip(node),
            "Neg" => self.negated(node),
            "Max" | "Min" => self.bounded(node),
            "Celu" => self.celu(node),
            "Gather" => self.gather(node),
            "Slice" => self.slice(node),
            "Split" => self.split(node),
            "ReduceMean" | "ReduceMax" | "ReduceSum" => self.reduce(node),
            "PRelu" => self.prelu(node),
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
                let g = match node.text("approximate").as_str() {
                    "" | "none" => Activation::Gelu,
                    "tanh" => Activation::GeluTanh,
                    other => {
                        let what = format!("the approximation {other:?} of Gelu");
                        return Err(node.unsupported(what, "none and tanh work"));
                    }
                };
                self.activation(node, g)
            }
            "Swish" => {
                if node.float("alpha", 1.0) != 1.0 {
                    let what = format!("a Swish of alpha {}", node.float("alpha", 1.0));
                    return Err(node.unsupported(what, "use alpha = 1"));
                }
                self.activation(node, Activation::Swish)
            }
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

    /// Up to opset 12 over all values from an axis on, by default all but the batch; from 13 on
    /// over one axis, by default the last.
    fn softmax(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let old = node.opset < 13;
        let axis = node.int("axis", if old { 1 } else { -1 });
        let axis = if old && axis == dims.len() as i64 {
            dims.len()
        } else {
            axis_of(node, axis, dims.len())?
        };
        let after = if old { axis } else { axis + 1 };
        let inner: usize = dims[after..].iter().product();
        let length = if old { inner } else { dims[axis] };
        if !old && inner != 1 {
            // The axis goes last and comes back.
            let order: Vec<usize> = (0..dims.len())
                .filter(|&a| a != axis)
                .chain([axis])
                .collect();
            let mut back: Vec<usize> = (0..dims.len() - 1).collect();
            back.insert(axis, dims.len() - 1);
            let batch = value.batch;
            let turned = self.transposed(node, value, &order)?;
            let place = self.rows(node, turned.place, turned.len(), length)?;
            let place = self.push(node, Op::Softmax, place)?;
            let turned = Value { place, ..turned };
            let found = self.transposed(node, turned, &back)?;
            return Ok(vec![found.reshaped(dims, batch)]);
        }
        let mut value = self.as_written(node, value)?;
        if value.shape.last().copied().unwrap_or(1) != length || value.shape.len() > 3 {
            value.place = self.rows(node, value.place, value.len(), length)?;
        }
        let place = self.push(node, Op::Softmax, value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    /// The values of a node as rows of `length`.
    fn rows(
        &mut self,
        node: &Node<'_>,
        place: usize,
        values: usize,
        length: usize,
    ) -> Result<usize, NetworkError> {
        let rows = values.checked_div(length).unwrap_or(0);
        let held = if rows == 1 {
            vec![length]
        } else {
            vec![rows, length]
        };
        self.held_as(node, place, held)
    }

    /// `W x + b` for `weights` of shape `[outputs][inputs]`, over the last axis.
    pub(super) fn dense(
        &mut self,
        node: &Node<'_>,
        weights: Tensor,
        bias: Vec<f32>,
    ) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let mut value = self.as_written(node, value)?;
        let outputs = bias.len();
        let mut dims = value.dims();
        if value.batch.is_some_and(|batch| batch + 1 == dims.len()) && dims.len() > 1 {
            // The last axis holds one feature, and is no batch.
            let batch = dims
                .iter()
                .position(|&n| n == 1)
                .filter(|&axis| axis + 1 < dims.len());
            value = value.reshaped(dims.clone(), batch);
            if batch.is_none() {
                value.shape = dims.clone();
                value.batch = None;
            }
        }
        let Some(last) = dims.last_mut() else {
            return Err(node.malformed("it reads a value without axes"));
        };
        let inputs = *last;
        if weights.shape.get(1) != Some(&inputs) {
            return Err(node.malformed(format!(
                "weights of {} inputs for a value of {inputs}",
                weights.shape.get(1).copied().unwrap_or(0)
            )));
        }
        *last = outputs;
        let rows = value.len() / inputs.max(1);
        let weights = weights.values;
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
        let mut from = value.place;
        if rows > 1 {
            let whole = (2..=3).contains(&value.shape.len()) && value.shape.last() == Some(&inputs);
            let held = if whole {
                value.shape.clone()
            } else {
                vec![rows, inputs]
            };
            from = self.held_as(node, from, held)?;
        }
        let place = self.push(node, op, from)?;
        Ok(vec![Value::of(place, dims, value.batch)])
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
            Some(bias) if bias.values.len() == outputs && bias.shape.last() == Some(&outputs) => {
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
        let mut weights = self.needed(node, 1)?.clone();
        // A vector gives a value without the axis; axes of 1 before the matrix change nothing.
        let vector = weights.shape.len() == 1;
        if vector {
            weights.shape.push(1);
        }
        while weights.shape.len() > 2 && weights.shape[0] == 1 {
            weights.shape.remove(0);
        }
        let weights = weights.transposed(&node.name)?;
        let bias = vec![0.0; weights.shape[0]];
        let mut found = self.dense(node, weights, bias)?;
        if let Some(value) = found.first_mut().filter(|_| vector) {
            let mut dims = value.dims();
            dims.pop();
            *value = value.reshaped(dims, value.batch);
        }
        Ok(found)
    }

    /// Rows and columns of an image and its channels last; the value has channels first.
    fn image(&mut self, node: &Node<'_>) -> Result<(Value, [usize; 2]), NetworkError> {
        let mut value = self.value(node, 0)?;
        if value.batch != Some(0) {
            let dims = value.dims();
            if dims.first() != Some(&1) {
                return Err(node.unsupported(
                    format!("{} over a batch of shape {dims:?}", node.proto.op_type),
                    "keep the batch, 1, as the first axis",
                ));
            }
            value = self.flat(node, value)?.reshaped(dims, Some(0));
        }
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
            side @ ("SAME_UPPER" | "SAME_LOWER") => {
                for axis in 0..2 {
                    let (before, after) =
                        pads::same(image[axis], size[axis], stride[axis], dilation[axis]);
                    // The odd one comes after, or before.
                    (window.before[axis], window.after[axis]) = if side == "SAME_UPPER" {
                        (before, after)
                    } else {
                        (after, before)
                    };
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
        let (value, image) = self.image(node)?;
        let one = value.shape.len() == 2;
        let weights = self.needed(node, 1)?.clone();
        weights.expect_axes(&node.name, if one { 3 } else { 4 })?;
        if let Some(size) = node.ints("kernel_shape") {
            let same = size
                .iter()
                .zip(&weights.shape[2..])
                .all(|(&a, &b)| a == b as i64);
            if !same || size.len() != weights.shape.len() - 2 {
                return Err(node.malformed(format!(
                    "kernel_shape {size:?} for weights of shape {:?}",
                    weights.shape
                )));
            }
        }
        let weights = ungrouped(node, weights, value.shape[0])?;
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
            batch: Some(0),
            last: true,
            gelu: None,
        }])
    }

    fn pool(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let (value, image) = self.image(node)?;
        let one = value.shape.len() == 2;
        let size = |n: i64| usize::try_from(n).unwrap_or(0);
        let size = match node.ints("kernel_shape") {
            Some(&[columns]) if one => [1, size(columns)],
            Some(&[rows, columns]) if !one => [size(rows), size(columns)],
            other => return Err(node.malformed(format!("kernel_shape is {other:?}"))),
        };
        let window = self.window(node, image, size, one)?;
        if node.int("ceil_mode", 0) != 0 {
            // It differs only where the last window would not fit.
            for (axis, &length) in image.iter().enumerate() {
                let reach =
                    (window.size[axis].max(1) - 1).saturating_mul(window.dilation[axis]) + 1;
                let padded = length
                    .saturating_add(window.before[axis])
                    .saturating_add(window.after[axis]);
                let left = padded
                    .saturating_sub(reach)
                    .checked_rem(window.stride[axis]);
                if left != Some(0) {
                    return Err(node.unsupported("ceil_mode = 1", "use ceil_mode = 0"));
                }
            }
        }
        let max = node.proto.op_type == "MaxPool";
        let kind = match (
            max,
            if max {
                0
            } else {
                node.int("count_include_pad", 0)
            },
        ) {
            (true, _) => PoolKind::Max,
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
        node.expect_int("spatial", 1, "use spatial = 1")?;
        node.expect_int("training_mode", 0, "export for inference")?;
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let value = if value.batch == Some(0) || dims.first() != Some(&1) {
            value
        } else {
            self.flat(node, value)?.reshaped(dims, Some(0))
        };
        if value.batch != Some(0) {
            return Err(
                node.unsupported("a batch of several", "keep the batch, 1, as the first axis")
            );
        }
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
        let Some(first) = values.first().cloned() else {
            return Err(node.malformed("it reads nothing"));
        };
        let dims = first.dims();
        let axis = axis_of(node, node.int("axis", 0), dims.len())?;
        let all: Vec<Vec<usize>> = values.iter().map(Value::dims).collect();
        let mut shape = dims.clone();
        for other in &all[1..] {
            let alike = other.len() == dims.len()
                && (0..dims.len()).all(|i| i == axis || other[i] == dims[i]);
            if !alike {
                return Err(
                    node.malformed(format!("{dims:?} and {other:?} differ beside axis {axis}"))
                );
            }
            shape[axis] += other[axis];
        }
        let same = values.iter().all(|value| value.batch == first.batch);
        let plain =
            same && first.batch.is_some() && first.batch != Some(axis) && first.shape.len() <= 3;
        let last = plain && values.iter().any(|value| value.last);
        let mut parts = Vec::new();
        for value in values {
            let value = if last {
                self.channels_last(node, value)?
            } else {
                self.as_written(node, value)?
            };
            parts.push(value);
        }
        let name = self.free_name(&node.name);
        if !plain {
            // Runs of what stands after the axis, one beside the other.
            let outer: usize = dims[..axis].iter().product();
            let mut from = Vec::new();
            for part in &parts {
                let run = part.len() / outer.max(1);
                let held = if outer == 1 {
                    vec![run]
                } else {
                    vec![outer, run]
                };
                from.push(self.held_as(node, part.place, held)?);
            }
            let name = self.free_name(&name);
            let place = self
                .network
                .push(&name, Op::Concatenate(usize::from(outer != 1)), from)?;
            return Ok(vec![Value::of(place, shape, first.batch)]);
        }
        let batch = first.batch.unwrap_or(0);
        let inner = if axis > batch { axis - 1 } else { axis };
        let axes = first.shape.len();
        let held = if last && axes > 1 {
            (inner + axes - 1) % axes
        } else {
            inner
        };
        let from = parts.iter().map(|part| part.place).collect();
        let place = self.network.push(&name, Op::Concatenate(held), from)?;
        shape.remove(batch);
        let first = parts.swap_remove(0);
        Ok(vec![Value {
            place,
            shape,
            ..first
        }])
    }

    fn flatten(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let dims = value.dims();
        let axis = node.int("axis", 1);
        let axis = if axis == dims.len() as i64 {
            dims.len()
        } else {
            axis_of(node, axis, dims.len())?
        };
        let dims = vec![dims[..axis].iter().product(), dims[axis..].iter().product()];
        self.reheld(node, &value, dims)
    }

    /// The value in another shape, and its node too where a node can have it.
    fn reheld(
        &mut self,
        node: &Node<'_>,
        value: &Value,
        dims: Vec<usize>,
    ) -> Result<Vec<Value>, NetworkError> {
        let mut found = value.reshaped(dims, Some(0));
        if (1..=3).contains(&found.shape.len()) {
            found.place = self.push(node, Op::Reshape(found.shape.clone()), value.place)?;
        }
        Ok(vec![found])
    }

    fn reshape(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let target = self.integers(node, 1, "shape");
        let target = target
            .ok_or_else(|| node.unsupported("a shape that is computed", "use a constant shape"))?;
        if node.int("allowzero", 0) != 0 && target.contains(&0) {
            return Err(node.unsupported("allowzero = 1", "use allowzero = 0"));
        }
        let dims = reshape_target(node, &target, &value.dims())?;
        self.reheld(node, &value, dims)
    }

    fn squeeze(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.flat(node, value)?;
        let axes = self.integers(node, 1, "axes");
        let dims = value.dims();
        let shape = squeezed(node, &dims, axes.clone())?;
        // The batch is where it was, but for the axes that came or went before it.
        let places: Vec<usize> = axes
            .unwrap_or_default()
            .iter()
            .map(|&axis| axis_of(node, axis, dims.len().max(shape.len())))
            .collect::<Result<_, _>>()?;
        let batch = value.batch.and_then(|batch| {
            if node.proto.op_type == "Unsqueeze" {
                return (0..shape.len())
                    .filter(|axis| !places.contains(axis))
                    .nth(batch);
            }
            let gone = places.iter().filter(|&&axis| axis < batch).count();
            (!places.contains(&batch) && !places.is_empty()).then(|| batch - gone)
        });
        Ok(vec![value.reshaped(shape, batch)])
    }

    fn transpose(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let order = transposition(node, value.dims().len())?;
        Ok(vec![self.transposed(node, value, &order)?])
    }

    /// From float32 to float32, or to what is computed in float32 here too.
    fn cast(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        match node.int("to", 0) as i32 {
            FLOAT | DOUBLE => Ok(vec![self.value(node, 0)?]),
            other => Err(node.unsupported(
                format!("a cast of a value to {}", type_name(other)),
                "export in float32",
            )),
        }
    }

    /// One index, or several, of an axis.
    fn gather(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let data = node.input(0).and_then(|name| self.constants.get(name));
        if data.is_some() {
            return Err(node.unsupported(
                "a Gather whose indices are values, an embedding,",
                "use MatMul on one-hot inputs",
            ));
        }
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axis = axis_of(node, node.int("axis", 0), dims.len())?;
        let name = node.input(1).unwrap_or("");
        let Some(Constant::Integers(indices)) = self.constants.get(name).cloned() else {
            return Err(node.unsupported(
                "a Gather whose indices are computed",
                "use constant indices",
            ));
        };
        let list = gathered(node, &indices.values, dims[axis])?;
        Ok(vec![self.selected(
            node,
            value,
            axis,
            &list,
            &indices.shape,
        )?])
    }

    fn slice(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let mut value = self.value(node, 0)?;
        let lists = [
            self.integers(node, 1, "starts"),
            self.integers(node, 2, "ends"),
            self.integers(node, 3, "axes"),
            self.integers(node, 4, "steps"),
        ];
        if node.input(3).is_some() && lists[2].is_none()
            || node.input(4).is_some() && lists[3].is_none()
        {
            return Err(node.unsupported("a slice whose axes are computed", "use constant axes"));
        }
        for (axis, [start, end, step]) in slices(node, lists, value.dims().len())? {
            let length = value.dims()[axis];
            let indices = slice_indices(length, start, end, step);
            value = self.selected(node, value, axis, &indices, &[indices.len()])?;
        }
        Ok(vec![value])
    }

    fn split(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axis = axis_of(node, node.int("axis", 0), dims.len())?;
        let outputs = node.proto.output.len().max(1);
        let parts = match self.integers(node, 1, "split") {
            Some(parts) => parts
                .iter()
                .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
                .collect(),
            None if node.input(1).is_some() => {
                return Err(node.unsupported("a split that is computed", "use constant lengths"));
            }
            None => {
                let count = usize::try_from(node.int("num_outputs", outputs as i64))
                    .unwrap_or(0)
                    .max(1);
                let each = dims[axis].div_ceil(count);
                let part = |i: usize| each.min(dims[axis].saturating_sub(i * each));
                (0..count).map(part).collect::<Vec<_>>()
            }
        };
        let total = parts.iter().fold(0_usize, |sum, &n| sum.saturating_add(n));
        if total != dims[axis] || parts.len() != outputs {
            return Err(node.malformed(format!("it splits {} into {parts:?}", dims[axis])));
        }
        let mut start = 0;
        let mut found = Vec::new();
        for (part, name) in parts.into_iter().zip(&node.proto.output) {
            let indices: Vec<usize> = (start..start + part).collect();
            start += part;
            // What nobody reads is not computed.
            found.push(if self.read.contains(name.as_str()) {
                self.selected(node, value.clone(), axis, &indices, &[part])?
            } else {
                value.clone()
            });
        }
        Ok(found)
    }

    /// The mean, largest or sum over axes, as a pool over everything that they span.
    fn reduce(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axes = self.integers(node, 1, "axes");
        if node.input(1).is_some() && axes.is_none() {
            return Err(node.unsupported("axes that are computed", "name the axes"));
        }
        let empty = axes.as_ref().is_none_or(Vec::is_empty);
        if empty && node.int("noop_with_empty_axes", 0) != 0 {
            return Ok(vec![value]);
        }
        let axes: Vec<usize> = match axes {
            Some(axes) if !axes.is_empty() => axes
                .iter()
                .map(|&axis| axis_of(node, axis, dims.len()))
                .collect::<Result<_, _>>()?,
            _ => (0..dims.len()).collect(),
        };
        let keep = node.int("keepdims", 1) != 0;
        let shape: Vec<usize> = (0..dims.len())
            .filter(|axis| keep || !axes.contains(axis))
            .map(|axis| if axes.contains(&axis) { 1 } else { dims[axis] })
            .collect();
        let batch = value.batch.and_then(|batch| {
            let gone = axes.iter().filter(|&&axis| axis < batch).count();
            if keep {
                Some(batch)
            } else {
                (!axes.contains(&batch)).then(|| batch - gone)
            }
        });
        let reduced: usize = axes.iter().map(|&axis| dims[axis]).product();
        let order: Vec<usize> = axes
            .iter()
            .copied()
            .chain((0..dims.len()).filter(|axis| !axes.contains(axis)))
            .collect();
        if order.len() != dims.len() {
            return Err(node.malformed(format!("an axis of {axes:?} stands twice")));
        }
        let turned = self.transposed(node, value, &order)?;
        let kept = turned.len() / reduced.max(1);
        let place = self.held_as(node, turned.place, vec![reduced, kept])?;
        let window = Window {
            size: [1, reduced],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let kind = if node.proto.op_type == "ReduceMax" {
            PoolKind::Max
        } else {
            PoolKind::Average
        };
        let mut place = self.push(node, Op::Pool(Pool { window, kind }), place)?;
        if node.proto.op_type == "ReduceSum" {
            let gain = vec![reduced as f32; kept];
            let offset = vec![0.0; kept];
            place = self.push(node, Op::Scale { gain, offset }, place)?;
        }
        Ok(vec![Value::of(place, shape, batch)])
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

    fn negated(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let place = self.scaled(node, value.place, -1.0, 0.0)?;
        Ok(vec![Value { place, ..value }])
    }

    /// `max(0, x) + min(0, alpha (exp(x / alpha) - 1))`.
    fn celu(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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
    fn clip(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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
    fn bounded(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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
    fn prelu(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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

/// A convolution in groups as one over all channels, with zeros between groups.
fn ungrouped(node: &Node<'_>, weights: Tensor, channels: usize) -> Result<Tensor, NetworkError> {
    let group = node.int("group", 1);
    if group == 1 {
        return Ok(weights);
    }
    let groups = usize::try_from(group).unwrap_or(0);
    let (filters, own) = (weights.shape[0], weights.shape[1]);
    let whole =
        groups > 0 && filters.is_multiple_of(groups) && own.checked_mul(groups) == Some(channels);
    if !whole {
        let message = format!("{group} groups for weights of shape {:?}", weights.shape);
        return Err(node.malformed(message));
    }
    let window: usize = weights.shape[2..].iter().product();
    let mut shape = weights.shape.clone();
    shape[1] = channels;
    let count = tensor::count(&node.name, &shape)?;
    if count > MAX_UNGROUPED {
        return Err(node.unsupported(
            format!("{groups} groups of {own} channels"),
            "use group = 1",
        ));
    }
    let mut values = vec![0.0; count];
    for filter in 0..filters {
        let first = filter / (filters / groups) * own;
        let from = &weights.values[filter * own * window..][..own * window];
        values[(filter * channels + first) * window..][..own * window].copy_from_slice(from);
    }
    Ok(Tensor { shape, values })
}
