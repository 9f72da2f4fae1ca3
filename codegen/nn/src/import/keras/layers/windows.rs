//! Layers that move a window over their input: convolutions and pools.

use serde_json::Value;

use super::Import;
use super::values::pair;
use crate::import::keras::config::Layer;
use crate::import::tensor::Tensor;
use crate::import::{groups as grouped, pads};
use crate::{Convolution, NetworkError, Op, Pool, PoolKind, Window};

impl Import<'_> {
    pub(super) fn convolution(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let config = &layer.config;
        let kernel = self.weights.get(layer, "kernel", 0)?;
        let kernel = if layer.class == "Conv1D" {
            kernel.expect_axes(name, 3)?;
            let shape = [&[1], kernel.shape.as_slice()].concat();
            Tensor::new(name, shape, kernel.values.clone())?
        } else {
            kernel.expect_axes(name, 4)?;
            kernel.clone()
        };
        let size = [kernel.shape[0], kernel.shape[1]];
        let window = self.window(layer, x, size, &config["strides"], &config["dilation_rate"])?;
        let bias = self.bias(layer, 1, kernel.shape[3])?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let groups = config["groups"].as_u64().unwrap_or(1);
        if groups.checked_mul(kernel.shape[2] as u64) != Some(channels as u64) {
            let shape = &kernel.shape;
            let message =
                format!("{groups} groups for {channels} channels and weights of {shape:?}");
            return Err(NetworkError::malformed(name, message));
        }
        let weights = kernel.permuted(&[3, 0, 1, 2]);
        let weights = grouped::ungrouped(name, weights, channels)?.values;
        self.push(
            name,
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            }),
            x,
        )
    }

    /// A convolution of each channel by itself, as one over all channels with zeros between them;
    /// of a separable one also the convolution of width 1 after it.
    pub(super) fn by_channels(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let one = layer.class.ends_with("1D");
        let separable = layer.class.starts_with("Separable");
        let read = |tensor: &Tensor| -> Result<Tensor, NetworkError> {
            tensor.expect_axes(name, if one { 3 } else { 4 })?;
            let lead = if one { &[1][..] } else { &[] };
            let shape = [lead, &tensor.shape].concat();
            Tensor::new(name, shape, tensor.values.clone())
        };
        // The multiplier shows in the shape of the weights, and so do the filters.
        let _ = &config["depth_multiplier"];
        let found = self.weights.find(layer, "depthwise_kernel", 0);
        let kernel = match found {
            Some(kernel) => read(kernel)?,
            None => read(self.weights.get(layer, "kernel", 0)?)?,
        };
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let [rows, columns, own, times] = kernel.shape[..] else {
            return Err(NetworkError::malformed(name, "weights without four axes"));
        };
        if own != channels {
            let message = format!(
                "weights of shape {:?} for {channels} channels",
                kernel.shape
            );
            return Err(NetworkError::malformed(name, message));
        }
        let window = self.window(
            layer,
            x,
            [rows, columns],
            &config["strides"],
            &config["dilation_rate"],
        )?;
        let filters = own * times;
        let bias = if separable {
            vec![0.0; filters]
        } else {
            self.bias(layer, 1, filters)?
        };
        // Filter `c times + m` is that of channel c alone.
        let groups = kernel.permuted(&[2, 3, 0, 1]);
        let groups = Tensor {
            shape: vec![filters, rows, columns, 1],
            values: groups.values,
        };
        let weights = grouped::ungrouped(name, groups, channels)?.values;
        let op = Op::Convolution(Convolution {
            window,
            weights,
            bias,
        });
        let place = self.push(name, op, x)?;
        if !separable {
            return Ok(place);
        }
        let points = read(self.weights.get(layer, "pointwise_kernel", 1)?)?;
        let outputs = points.shape[3];
        points.expect_shape(name, &[1, 1, filters, outputs])?;
        let bias = self.bias(layer, 2, outputs)?;
        let op = Op::Convolution(Convolution {
            window: Window {
                size: [1; 2],
                stride: [1; 2],
                dilation: [1; 2],
                before: [0; 2],
                after: [0; 2],
            },
            weights: points.permuted(&[3, 0, 1, 2]).values,
            bias,
        });
        self.network.append(&format!("{name} points"), op, &[place])
    }

    /// A window with the layer's padding.
    pub(super) fn window(
        &self,
        layer: &Layer<'_>,
        x: usize,
        size: [usize; 2],
        strides: &Value,
        dilation: &Value,
    ) -> Result<Window, NetworkError> {
        let shape = &self.network.nodes[x].shape;
        let one = layer.class.ends_with("1D");
        let image = match (one, shape.as_slice()) {
            (true, &[columns, _]) => [1, columns],
            (false, &[rows, columns, _]) => [rows, columns],
            _ => {
                let message = format!("{} cannot read {shape:?}", layer.class);
                return Err(NetworkError::malformed(&layer.name, message));
            }
        };
        let stride = pair(strides, one, 1);
        let dilation = pair(dilation, one, 1);
        let mut window = Window {
            size,
            stride,
            dilation,
            before: [0; 2],
            after: [0; 2],
        };
        match layer.config["padding"].as_str().unwrap_or("valid") {
            "valid" => {}
            "same" => {
                for axis in 0..2 {
                    let (before, after) =
                        pads::same(image[axis], size[axis], stride[axis], dilation[axis]);
                    (window.before[axis], window.after[axis]) = (before, after);
                }
            }
            "causal" if one => {
                window.before[1] = size[1].saturating_sub(1).saturating_mul(dilation[1])
            }
            other => {
                let message = format!("the padding {other:?}");
                return Err(NetworkError::unsupported(
                    &layer.name,
                    message,
                    "use 'valid' or 'same'",
                ));
            }
        }
        Ok(window)
    }

    pub(super) fn pool(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
        kind: PoolKind,
    ) -> Result<usize, NetworkError> {
        let one = layer.class.ends_with("1D");
        let size = pair(&layer.config["pool_size"], one, 2);
        let strides = &layer.config["strides"];
        let strides = if strides.is_null() {
            &layer.config["pool_size"]
        } else {
            strides
        };
        let window = self.window(layer, x, size, strides, &Value::Null)?;
        self.push(&layer.name, Op::Pool(Pool { window, kind }), x)
    }

    pub(super) fn global_pool(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
        kind: PoolKind,
    ) -> Result<usize, NetworkError> {
        let shape = self.network.nodes[x].shape.clone();
        let (size, channels) = match *shape.as_slice() {
            [columns, channels] => ([1, columns], channels),
            [rows, columns, channels] => ([rows, columns], channels),
            _ => {
                let message = format!("{} cannot read {shape:?}", layer.class);
                return Err(NetworkError::malformed(&layer.name, message));
            }
        };
        let window = Window {
            size,
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let keep = layer.config["keepdims"].as_bool() == Some(true);
        let pool = self.push(&layer.name, Op::Pool(Pool { window, kind }), x)?;
        if keep {
            return Ok(pool);
        }
        self.push(
            &format!("{} flat", layer.name),
            Op::Reshape(vec![channels]),
            pool,
        )
    }
}
