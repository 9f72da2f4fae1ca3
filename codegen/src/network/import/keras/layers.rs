//! Each class of Keras layers as nodes of the network.

use serde_json::Value;

use super::config::Layer;
use super::weights::Weights;
use crate::network::import::tensor::Tensor;
use crate::network::import::{pads, shapes};
use crate::network::{
    Activation, Cell, Convolution, Dense, Network, NetworkError, Op, Pool, PoolKind, Recurrent,
    Window,
};

/// Layers that do nothing once a network is trained.
const IDLE: &[&str] = &[
    "Dropout",
    "SpatialDropout1D",
    "SpatialDropout2D",
    "AlphaDropout",
    "GaussianDropout",
    "GaussianNoise",
    "ActivityRegularization",
    "Identity",
];

/// Classes that are known not to work, and what is nearest.
const NEAREST: &[(&str, &str)] = &[
    ("DepthwiseConv2D", "use Conv2D"),
    ("DepthwiseConv1D", "use Conv1D"),
    ("SeparableConv2D", "use Conv2D"),
    ("SeparableConv1D", "use Conv1D"),
    ("Conv2DTranspose", "use Conv2D"),
    ("Conv3D", "use Conv2D"),
    (
        "Bidirectional",
        "use two layers, the second on reversed input, and concatenate",
    ),
    ("ConvLSTM2D", "use Conv2D and LSTM"),
    ("PReLU", "use LeakyReLU"),
    ("ThresholdedReLU", "use ReLU"),
    (
        "LayerNormalization",
        "use BatchNormalization, which is folded into weights",
    ),
    ("GroupNormalization", "use BatchNormalization"),
    ("MultiHeadAttention", "use GRU"),
    ("Embedding", "use Dense on one-hot inputs"),
    ("ZeroPadding1D", "use padding='same' in the convolution"),
    ("ZeroPadding2D", "use padding='same' in the convolution"),
    ("Subtract", "use Add after a Dense of negative weights"),
    ("Multiply", "use Add or Concatenate"),
    ("Average", "use Add and halve the weights after it"),
    ("Lambda", "write it as layers"),
    (
        "Sequential",
        "write its layers into the model that holds it",
    ),
    (
        "Functional",
        "write its layers into the model that holds it",
    ),
];

/// A network under construction.
pub(super) struct Import<'a> {
    network: Network,
    weights: &'a Weights,
    keras_2: bool,
    /// A call is one step of a sequence.
    streaming: bool,
}

impl<'a> Import<'a> {
    pub(super) fn new(
        network: Network,
        weights: &'a Weights,
        keras_2: bool,
        streaming: bool,
    ) -> Self {
        Self {
            network,
            weights,
            keras_2,
            streaming,
        }
    }

    /// The network, with `output` its last layer.
    pub(super) fn finish(mut self, output: usize) -> Network {
        if output > 0 && output + 1 < self.network.nodes.len() {
            self.network.nodes.truncate(output + 1);
        }
        self.network.drop_unread();
        self.network
    }

    /// Adds a layer and gives the place of its result.
    ///
    /// # Errors
    /// [`NetworkError`].
    pub(super) fn layer(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<usize, NetworkError> {
        let name = layer.name.as_str();
        let config = layer.config;
        let x = from[0];
        if config["data_format"].as_str() == Some("channels_first") {
            return Err(NetworkError::unsupported(
                name,
                "channels first",
                "use data_format='channels_last'",
            ));
        }
        if IDLE.contains(&layer.class) {
            return Ok(x);
        }
        self.refuse_across_time(layer, x)?;
        match layer.class {
            "Dense" => {
                let dense = self.dense(layer, x)?;
                self.activate(layer, dense)
            }
            "TimeDistributed" => self.time_distributed(layer, x),
            "Conv1D" | "Conv2D" => {
                let convolution = self.convolution(layer, x)?;
                self.activate(layer, convolution)
            }
            "MaxPooling1D" | "MaxPooling2D" => self.pool(layer, x, PoolKind::Max),
            "AveragePooling1D" | "AveragePooling2D" => self.pool(layer, x, PoolKind::Average),
            "GlobalMaxPooling1D" | "GlobalMaxPooling2D" => {
                self.global_pool(layer, x, PoolKind::Max)
            }
            "GlobalAveragePooling1D" | "GlobalAveragePooling2D" => {
                self.global_pool(layer, x, PoolKind::Average)
            }
            "Flatten" => {
                let length = self.network.nodes[x].len();
                self.push(name, Op::Reshape(vec![length]), x)
            }
            "Reshape" => {
                let target = config["target_shape"]
                    .as_array()
                    .cloned()
                    .unwrap_or_default();
                let target: Vec<i64> = target.iter().map(|n| n.as_i64().unwrap_or(0)).collect();
                let shape = shapes::open(name, &target, self.network.nodes[x].len())?;
                self.push(name, Op::Reshape(shape), x)
            }
            "Permute" => {
                let dims = config["dims"].as_array().cloned().unwrap_or_default();
                let axis = |n: &Value| {
                    n.as_u64()
                        .map_or(usize::MAX, |n| (n as usize).wrapping_sub(1))
                };
                self.push(name, Op::Permute(dims.iter().map(axis).collect()), x)
            }
            "Activation" => self.activate(layer, x),
            "ReLU" => self.relu(layer, x),
            "LeakyReLU" => {
                let alpha = float(&config["negative_slope"])
                    .or(float(&config["alpha"]))
                    .unwrap_or(0.3);
                self.push(name, Op::Activation(Activation::LeakyRelu { alpha }), x)
            }
            "ELU" => {
                let alpha = float(&config["alpha"]).unwrap_or(1.0);
                self.push(
                    name,
                    Op::Activation(Activation::Elu { alpha, scale: 1.0 }),
                    x,
                )
            }
            "Softmax" => {
                self.expect_last_axis(layer, &config["axis"], x)?;
                self.push(name, Op::Softmax, x)
            }
            "BatchNormalization" => self.batch_norm(layer, x),
            "Normalization" => self.normalization(layer, x),
            "Rescaling" => self.rescaling(layer, x),
            "SimpleRNN" | "GRU" | "LSTM" => self.recurrent(layer, x),
            "Add" => self.network.push(name, Op::Add, from.to_vec()),
            "Concatenate" => {
                let axes = self.network.nodes[x].shape.len();
                let axis = axis_of(name, &config["axis"], axes)?;
                self.network
                    .push(name, Op::Concatenate(axis), from.to_vec())
            }
            other => {
                let nearest = NEAREST.iter().find(|(class, _)| *class == other);
                let nearest =
                    nearest.map_or("see docs/networks.md for the layers that are", |(_, n)| n);
                Err(NetworkError::unsupported(
                    name,
                    format!("the layer {other}"),
                    nearest,
                ))
            }
        }
    }

    fn push(&mut self, name: &str, op: Op, from: usize) -> Result<usize, NetworkError> {
        self.network.push(name, op, vec![from])
    }

    /// With one step a call, a layer cannot see the steps beside it.
    fn refuse_across_time(&self, layer: &Layer<'_>, from: usize) -> Result<(), NetworkError> {
        let across = [
            "Conv1D",
            "MaxPooling1D",
            "AveragePooling1D",
            "GlobalMaxPooling1D",
            "GlobalAveragePooling1D",
            "Permute",
        ];
        let over_time = self.network.nodes[from].shape.len() == 2;
        if self.streaming && over_time && across.contains(&layer.class) {
            return Err(NetworkError::unsupported(
                &layer.name,
                format!("{} over a sequence of open length", layer.class),
                "give the model a fixed number of steps, Input((steps, features))",
            ));
        }
        Ok(())
    }

    /// The layer's `activation`, after node `from`.
    fn activate(&mut self, layer: &Layer<'_>, from: usize) -> Result<usize, NetworkError> {
        let name = format!("{} activation", layer.name);
        let name = if layer.class == "Activation" {
            layer.name.clone()
        } else {
            name
        };
        match activation_name(layer.config, "activation") {
            "softmax" => self.push(&name, Op::Softmax, from),
            other => match self.activation(&layer.name, other)? {
                Activation::Linear => Ok(from),
                g => self.push(&name, Op::Activation(g), from),
            },
        }
    }

    fn activation(&self, layer: &str, name: &str) -> Result<Activation, NetworkError> {
        if self.keras_2 && name == "hard_sigmoid" {
            return Ok(Activation::HardSigmoid {
                alpha: 0.2,
                beta: 0.5,
            });
        }
        Activation::named(layer, name)
    }

    fn dense(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let kernel = self.weights.get(layer, "kernel", 0)?;
        kernel.expect_axes(name, 2)?;
        let units = kernel.shape[1];
        let bias = self.bias(layer, 1, units)?;
        let weights = kernel.transposed(name)?.values;
        // One row of features is the whole input of a dense layer; several are a convolution's.
        let shape = &self.network.nodes[x].shape;
        if shape.iter().rev().skip(1).all(|&axis| axis == 1) {
            return self.push(name, Op::Dense(Dense { weights, bias }), x);
        }
        let window = Window {
            size: [1; 2],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
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

    /// The bias, or zeros where the layer has none.
    fn bias(
        &self,
        layer: &Layer<'_>,
        number: usize,
        units: usize,
    ) -> Result<Vec<f32>, NetworkError> {
        if layer.config["use_bias"].as_bool() == Some(false) {
            return Ok(vec![0.0; units]);
        }
        let bias = self.weights.get(layer, "bias", number)?;
        bias.expect_shape(&layer.name, &[units])?;
        Ok(bias.values.clone())
    }

    fn time_distributed(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let inner = &layer.config["layer"];
        let class = inner["class_name"].as_str().unwrap_or("");
        if !["Dense", "Activation"].contains(&class) {
            return Err(NetworkError::unsupported(
                &layer.name,
                format!("{class} at each step"),
                "TimeDistributed works with Dense and Activation",
            ));
        }
        // Its weights are found under the wrapper's own class.
        let inside = Layer {
            name: layer.name.clone(),
            class: layer.class,
            config: &inner["config"],
            from: Vec::new(),
            number: layer.number,
        };
        let place = if class == "Dense" {
            self.dense(&inside, x)?
        } else {
            x
        };
        self.activate(&inside, place)
    }

    fn convolution(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let config = layer.config;
        if config["groups"].as_u64().unwrap_or(1) != 1 {
            return Err(NetworkError::unsupported(
                name,
                "a convolution in groups",
                "use groups=1",
            ));
        }
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
        let weights = kernel.permuted(&[3, 0, 1, 2]).values;
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

    /// A window with the layer's padding.
    fn window(
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

    fn pool(&mut self, layer: &Layer<'_>, x: usize, kind: PoolKind) -> Result<usize, NetworkError> {
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

    fn global_pool(
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

    fn relu(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let config = layer.config;
        let zero = |key: &str| float(&config[key]).unwrap_or(0.0);
        if !config["max_value"].is_null() || zero("threshold") != 0.0 {
            return Err(NetworkError::unsupported(
                &layer.name,
                "a ReLU with max_value or threshold",
                "use ReLU without them",
            ));
        }
        let g = match zero("negative_slope") {
            0.0 => Activation::Relu,
            alpha => Activation::LeakyRelu { alpha },
        };
        self.push(&layer.name, Op::Activation(g), x)
    }

    fn expect_last_axis(
        &self,
        layer: &Layer<'_>,
        axis: &Value,
        x: usize,
    ) -> Result<(), NetworkError> {
        let axes = self.network.nodes[x].shape.len();
        let axis = if axis.is_array() { &axis[0] } else { axis };
        if axis.is_null() || axis_of(&layer.name, axis, axes)? + 1 == axes {
            return Ok(());
        }
        Err(NetworkError::unsupported(
            &layer.name,
            format!("axis {axis}"),
            "use the last axis, -1",
        ))
    }

    fn batch_norm(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        self.expect_last_axis(layer, &layer.config["axis"], x)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let mut number = 0;
        let mut next = |name: &str, present: bool, otherwise: f32| {
            if !present {
                return Ok(vec![otherwise; channels]);
            }
            let tensor = self.weights.get(layer, name, number)?;
            number += 1;
            tensor.expect_shape(&layer.name, &[channels])?;
            Ok(tensor.values.clone())
        };
        let has = |key: &str| layer.config[key].as_bool() != Some(false);
        let gamma = next("gamma", has("scale"), 1.0)?;
        let beta = next("beta", has("center"), 0.0)?;
        let mean = next("moving_mean", true, 0.0)?;
        let variance = next("moving_variance", true, 1.0)?;
        let epsilon = layer.config["epsilon"].as_f64().unwrap_or(1e-3);
        let op = normalise([&gamma, &beta, &mean, &variance], epsilon);
        self.push(&layer.name, op, x)
    }

    fn normalization(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        self.expect_last_axis(layer, &layer.config["axis"], x)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let list = |key: &str, number: usize| -> Result<Vec<f32>, NetworkError> {
            let mut values = numbers(&layer.config[key]);
            if values.is_empty() {
                values = self.weights.get(layer, key, number)?.values.clone();
            }
            if values.len() == 1 {
                values = vec![values[0]; channels];
            }
            if values.len() != channels {
                let message = format!("{} values of {key}: expected {channels}", values.len());
                return Err(NetworkError::malformed(&layer.name, message));
            }
            Ok(values)
        };
        let (mean, variance) = (list("mean", 0)?, list("variance", 1)?);
        // Keras holds the standard deviation above its epsilon, 1e-7.
        let gain = |&v: &f32| 1.0 / f64::from(v).sqrt().max(1e-7);
        let op = Op::Scale {
            gain: variance.iter().map(|v| gain(v) as f32).collect(),
            offset: mean
                .iter()
                .zip(&variance)
                .map(|(m, v)| (-f64::from(*m) * gain(v)) as f32)
                .collect(),
        };
        self.push(&layer.name, op, x)
    }

    fn rescaling(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let number = |key: &str, otherwise| {
            let values = numbers(&layer.config[key]);
            match values.len() {
                0 => vec![otherwise; channels],
                1 => vec![values[0]; channels],
                _ => values,
            }
        };
        let op = Op::Scale {
            gain: number("scale", 1.0),
            offset: number("offset", 0.0),
        };
        self.push(&layer.name, op, x)
    }

    fn recurrent(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, layer.config);
        for (key, nearest) in [
            ("go_backwards", "reverse the input"),
            (
                "return_state",
                "use return_state=False: the emitted State has it",
            ),
        ] {
            if config[key].as_bool() == Some(true) {
                return Err(NetworkError::unsupported(
                    name,
                    format!("{key}=True"),
                    nearest,
                ));
            }
        }
        let g = self.activation(name, activation_name(config, "activation"))?;
        let gates = || self.activation(name, activation_name(config, "recurrent_activation"));
        let cell = match layer.class {
            "SimpleRNN" => Cell::Simple { activation: g },
            "GRU" => Cell::Gru {
                activation: g,
                gates: gates()?,
                reset_after: config["reset_after"].as_bool().unwrap_or(false),
            },
            _ => Cell::Lstm {
                activation: g,
                gates: gates()?,
            },
        };
        let kernel = self.weights.get(layer, "kernel", 0)?.transposed(name)?;
        let recurrent = self
            .weights
            .get(layer, "recurrent_kernel", 1)?
            .transposed(name)?;
        let units = recurrent.shape[1];
        let reset_after = matches!(
            cell,
            Cell::Gru {
                reset_after: true,
                ..
            }
        );
        let rows = cell.gates() * units;
        let (bias, inner_bias) = if config["use_bias"].as_bool() == Some(false) {
            (
                vec![0.0; rows],
                if reset_after {
                    vec![0.0; units]
                } else {
                    Vec::new()
                },
            )
        } else {
            let bias = self.weights.get(layer, "bias", 2)?;
            let shape: &[usize] = if reset_after { &[2, rows] } else { &[rows] };
            bias.expect_shape(name, shape)?;
            crate::network::import::gru_bias(&bias.values, rows, units, reset_after)
        };
        let stateful = config["stateful"].as_bool() == Some(true);
        let steps = match self.network.nodes[x].shape.as_slice() {
            [steps, _] => *steps,
            _ => 1,
        };
        let op = Op::Recurrent(Recurrent {
            cell,
            units,
            kernel: kernel.values,
            recurrent: recurrent.values,
            bias,
            inner_bias,
            sequences: config["return_sequences"].as_bool() == Some(true),
            streaming: self.streaming || (stateful && steps == 1),
        });
        self.push(name, op, x)
    }
}

/// Batch normalisation as a scale: `gamma (x - mean) / sqrt(variance + epsilon) + beta`.
pub(in crate::network::import) fn normalise(
    [gamma, beta, mean, variance]: [&[f32]; 4],
    epsilon: f64,
) -> Op {
    let gain: Vec<f64> = (gamma.iter().zip(variance))
        .map(|(&g, &v)| f64::from(g) / (f64::from(v) + epsilon).sqrt())
        .collect();
    let offset = beta.iter().zip(mean).zip(&gain);
    Op::Scale {
        offset: offset
            .map(|((&b, &m), g)| (f64::from(b) - f64::from(m) * g) as f32)
            .collect(),
        gain: gain.iter().map(|&g| g as f32).collect(),
    }
}

/// The name of an activation: a text, or an object with one.
fn activation_name<'v>(config: &'v Value, key: &str) -> &'v str {
    let value = &config[key];
    let inner = value["config"].as_str().or(value["class_name"].as_str());
    value.as_str().or(inner).unwrap_or("linear")
}

fn float(value: &Value) -> Option<f32> {
    value.as_f64().map(|x| x as f32)
}

/// Numbers in a list, in lists, or one alone.
fn numbers(value: &Value) -> Vec<f32> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        _ => float(value).into_iter().collect(),
    }
}

/// Rows and columns of a size; one number stands for both, and for the columns where there is one axis.
fn pair(value: &Value, one: bool, otherwise: usize) -> [usize; 2] {
    let size = |value: &Value| value.as_u64().and_then(|n| usize::try_from(n).ok());
    let list: Vec<usize> = match value {
        Value::Array(list) => list.iter().filter_map(size).collect(),
        _ => size(value).into_iter().collect(),
    };
    match (one, list.as_slice()) {
        (true, [columns, ..]) => [1, *columns],
        (true, []) => [1, otherwise],
        (false, [rows, columns, ..]) => [*rows, *columns],
        (false, [both]) => [*both, *both],
        (false, []) => [otherwise; 2],
    }
}

/// An axis without the batch; negative ones count from the end.
fn axis_of(layer: &str, value: &Value, axes: usize) -> Result<usize, NetworkError> {
    let axis = value.as_i64().unwrap_or(-1);
    let place = if axis < 0 {
        axis + axes as i64
    } else {
        axis - 1
    };
    usize::try_from(place)
        .ok()
        .filter(|&place| place < axes)
        .ok_or_else(|| {
            NetworkError::malformed(layer, format!("axis {axis} of {axes} axes and the batch"))
        })
}
