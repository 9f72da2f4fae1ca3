//! Layers of images: convolution, pooling and batch normalisation, with channels last.

use super::{Import, Node, Value};
use crate::import::groups::MAX_UNGROUPED;
use crate::import::keras::normalise;
use crate::import::pads;
use crate::import::tensor::{self, Tensor};
use crate::{Convolution, NetworkError, Op, Pool, PoolKind, Window};

impl Import<'_> {
    /// Rows and columns of an image and its channels last; the value has channels first.
    fn image(&mut self, node: &Node<'_>) -> Result<(Value, [usize; 2]), NetworkError> {
        let mut value = self.value(node, 0)?;
        for axis in 2..value.dims().len() {
            self.expect_no_steps(node, &value, axis)?;
        }
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

    pub(super) fn conv(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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

    pub(super) fn pool(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let (value, image) = self.image(node)?;
        let one = value.shape.len() == 2;
        let size = |n: i64| usize::try_from(n).unwrap_or(0);
        let size = match node.ints("kernel_shape") {
            Some(&[columns]) if one => [1, size(columns)],
            Some(&[rows, columns]) if !one => [size(rows), size(columns)],
            other => return Err(node.malformed(format!("kernel_shape is {other:?}"))),
        };
        let mut window = self.window(node, image, size, one)?;
        let max = node.proto.op_type == "MaxPool";
        let counted = !max && node.int("count_include_pad", 0) != 0;
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
                let Some(left) = left.filter(|&left| left > 0) else {
                    continue;
                };
                // A window that would begin in the padding behind is left out.
                let stride = window.stride[axis];
                let begin = padded.saturating_sub(reach) - left + stride;
                if begin >= length.saturating_add(window.before[axis]) {
                    continue;
                }
                if counted {
                    let what = "ceil_mode = 1 with count_include_pad = 1";
                    return Err(node.unsupported(what, "use ceil_mode = 0"));
                }
                window.after[axis] = window.after[axis].saturating_add(stride - left);
            }
        }
        let kind = match (max, counted) {
            (true, _) => PoolKind::Max,
            (_, false) => PoolKind::Average,
            _ => PoolKind::AverageWithPadding,
        };
        self.image_layer(node, &value, Op::Pool(Pool { window, kind }))
    }

    pub(super) fn global_pool(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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

    pub(super) fn batch_norm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
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
