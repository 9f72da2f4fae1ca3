//! Each class of Keras layers as nodes of the network.

mod movement;
mod normalisation;
mod operation;
mod recurrent;
mod reductions;
mod values;
mod windows;

use serde_json::Value;

use super::config::{Layer, expect_own};
use super::idle::IDLE;
use super::settings::{Settings, expect_float, quantised};
use super::weights::Weights;
use crate::import::shapes;
use crate::{Activation, Convolution, Dense, Network, NetworkError, Op, PoolKind, Window};
pub(in crate::import) use normalisation::normalise;
use recurrent::RECURRENT;
use values::{activation_name, axis_of, stated};

/// Layers that read several values.
const SEVERAL: &[&str] = &[
    "Add",
    "Subtract",
    "Multiply",
    "Average",
    "Maximum",
    "Minimum",
    "Concatenate",
];

/// Classes that are known not to work, and what is nearest.
const NEAREST: &[(&str, &str)] = &[
    ("Conv1DTranspose", "use UpSampling1D and Conv1D"),
    ("Conv2DTranspose", "use UpSampling2D and Conv2D"),
    ("Conv3D", "use Conv2D"),
    ("ConvLSTM2D", "use Conv2D and LSTM"),
    ("ThresholdedReLU", "use ReLU"),
    ("SpectralNormalization", "save the layer that it wraps"),
    ("EinsumDense", "use Dense, which works at every step"),
    ("MultiHeadAttention", "use GRU"),
    ("Embedding", "use Dense on one-hot inputs"),
    ("Dot", "use Multiply and a Dense of ones"),
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

    /// Adds a layer and gives the places of its outputs.
    ///
    /// # Errors
    /// [`NetworkError`].
    pub(super) fn outputs(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        if layer.class == "Split" && !layer.operands.is_empty() {
            return self.split(layer, from);
        }
        let place = self.layer(layer, from)?;
        if RECURRENT.contains(&layer.class) && layer.config["return_state"].as_bool() == Some(true)
        {
            return Ok(vec![place, self.state(layer, place)?]);
        }
        Ok(vec![place])
    }

    fn layer(&mut self, layer: &Layer<'_>, from: &[usize]) -> Result<usize, NetworkError> {
        let name = layer.name.as_str();
        let config = &layer.config;
        let x = from[0];
        if config["data_format"].as_str() == Some("channels_first") {
            return Err(NetworkError::unsupported(
                name,
                "channels first",
                "use data_format='channels_last'",
            ));
        }
        if !layer.operands.is_empty() {
            return self.operation(layer, from);
        }
        if from.len() != 1 && !SEVERAL.contains(&layer.class) {
            return Err(NetworkError::unsupported(
                name,
                format!("{} of {} values", layer.class, from.len()),
                format!("{} read several", SEVERAL.join(", ")),
            ));
        }
        if IDLE.contains(&layer.class) {
            return Ok(x);
        }
        if layer.class != "Dense" && quantised(&config["dtype"]).is_some() {
            return Err(NetworkError::unsupported(
                name,
                format!("a quantised {}", layer.class),
                "a quantised Dense works, and float32, from which the emitter quantises",
            ));
        }
        self.refuse_across_time(layer, x)?;
        match layer.class {
            "Dense" => {
                let dense = self.dense(layer, x)?;
                let place = self.activate(layer, dense)?;
                self.keep_axes(name, x, place)
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
                let slope = |key: &str| stated(name, key, &config[key]);
                let alpha = slope("negative_slope")?.or(slope("alpha")?).unwrap_or(0.3);
                self.push(name, Op::Activation(Activation::LeakyRelu { alpha }), x)
            }
            "ELU" => {
                let alpha = stated(name, "alpha", &config["alpha"])?.unwrap_or(1.0);
                self.push(
                    name,
                    Op::Activation(Activation::Elu { alpha, scale: 1.0 }),
                    x,
                )
            }
            "Softmax" => self.softmax(layer, Op::Softmax, x),
            "BatchNormalization" => self.batch_norm(layer, x),
            "LayerNormalization" => self.layer_norm(layer, x),
            "PReLU" => self.prelu(layer, x),
            "DepthwiseConv1D" | "DepthwiseConv2D" | "SeparableConv1D" | "SeparableConv2D" => {
                let place = self.by_channels(layer, x)?;
                self.activate(layer, place)
            }
            "ZeroPadding1D" | "ZeroPadding2D" | "Cropping1D" | "Cropping2D" => {
                self.padded(layer, x)
            }
            "UpSampling1D" | "UpSampling2D" => self.enlarged(layer, x),
            "RepeatVector" => self.repeated(layer, x),
            "Bidirectional" => self.both_ways(layer, x),
            "Normalization" => self.normalization(layer, x),
            "Rescaling" => self.rescaling(layer, x),
            class if RECURRENT.contains(&class) => self.recurrent(layer, x),
            "GroupNormalization" => self.group_norm(layer, x),
            "RMSNormalization" => self.rms_norm(layer, x),
            "UnitNormalization" => self.unit_norm(layer, x),
            "Add" | "Subtract" | "Multiply" | "Average" | "Maximum" | "Minimum" => {
                self.of_values(layer, from)
            }
            "Concatenate" => {
                let axes = self.network.nodes[x].shape.len();
                let axis = axis_of(name, &config["axis"], axes)?;
                if self.streaming && axes == 2 && axis == 0 {
                    return Err(NetworkError::unsupported(
                        name,
                        "Concatenate along the steps of a sequence of open length",
                        "give the model a fixed number of steps, Input((steps, features))",
                    ));
                }
                self.network
                    .push(name, Op::Concatenate(axis), from.to_vec())
            }
            other => {
                let nearest = NEAREST.iter().find(|(class, _)| *class == other);
                let nearest = nearest.map_or(
                    "see docs/reference/networks.md for the layers that are",
                    |(_, n)| n,
                );
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
            "Flatten",
            "Reshape",
            "DepthwiseConv1D",
            "SeparableConv1D",
            "ZeroPadding1D",
            "Cropping1D",
            "UpSampling1D",
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
        match activation_name(&layer.name, &layer.config, "activation")? {
            "softmax" => self.push(&name, Op::Softmax, from),
            "log_softmax" => self.push(&name, Op::LogSoftmax, from),
            other => match self.network.named_composite(&name, other, from) {
                Some(place) => place,
                None => self.plain_activation(layer, &name, other, from),
            },
        }
    }

    /// An activation that is one function.
    fn plain_activation(
        &mut self,
        layer: &Layer<'_>,
        name: &str,
        function: &str,
        from: usize,
    ) -> Result<usize, NetworkError> {
        match self.activation(&layer.name, function)? {
            Activation::Linear => Ok(from),
            g => self.push(name, Op::Activation(g), from),
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
        let mut weights = kernel.transposed(name)?.values;
        if quantised(&layer.config["dtype"]).is_some() {
            // Keras multiplied the weights by the scale before it rounded them.
            let biased = layer.config["use_bias"].as_bool() != Some(false);
            let scale = self
                .weights
                .get(layer, "kernel_scale", 1 + usize::from(biased))?;
            scale.expect_shape(name, &[units])?;
            let _ = &layer.config["quantization_config"];
            for (row, scale) in weights.chunks_mut(kernel.shape[0]).zip(&scale.values) {
                row.iter_mut().for_each(|w| *w /= scale);
            }
        }
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

    /// Gives the result `place` of a dense layer the axes of what it read, `x`: one row of features
    /// in a sequence or an image of length 1 stays one.
    fn keep_axes(&mut self, name: &str, x: usize, place: usize) -> Result<usize, NetworkError> {
        let (before, after) = (&self.network.nodes[x].shape, &self.network.nodes[place]);
        if before.len() == after.shape.len() {
            return Ok(place);
        }
        let mut shape = vec![1; before.len() - 1];
        shape.push(after.len());
        self.push(&format!("{name} axes"), Op::Reshape(shape), place)
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
        let inner = layer.config.inner("layer");
        let class = inner["class_name"].as_str().unwrap_or("");
        if !["Dense", "Activation"].contains(&class) {
            return Err(NetworkError::unsupported(
                &layer.name,
                format!("{class} at each step"),
                "TimeDistributed works with Dense and Activation",
            ));
        }
        expect_own(&layer.name, class, inner)?;
        // Its weights are found under the wrapper's own class.
        let inside = Layer {
            name: layer.name.clone(),
            class: layer.class,
            config: Settings::new(&inner["config"]),
            from: Vec::new(),
            operands: Vec::new(),
            key: layer.key,
            side: "",
            number: layer.number,
        };
        expect_float(&layer.name, &inside.config["dtype"])?;
        let place = if class == "Dense" {
            self.dense(&inside, x)?
        } else {
            x
        };
        let place = self.activate(&inside, place)?;
        inside.config.expect_read(&layer.name, class)?;
        self.keep_axes(&layer.name, x, place)
    }

    fn relu(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let config = &layer.config;
        let name = &layer.name;
        let zero = |key: &str| Ok(stated(name, key, &config[key])?.unwrap_or(0.0));
        let (threshold, alpha) = (zero("threshold")?, zero("negative_slope")?);
        if threshold != 0.0 {
            return Err(NetworkError::unsupported(
                name,
                format!("a ReLU of threshold {threshold}, which jumps there,"),
                "use threshold=0: a jump has no derivative",
            ));
        }
        let most = stated(name, "max_value", &config["max_value"])?;
        let place = match (alpha, most) {
            (0.0, Some(most)) if most > 0.0 => return self.network.clipped(name, x, 0.0, most),
            (0.0, _) => self
                .network
                .append(name, Op::Activation(Activation::Relu), &[x])?,
            (alpha, _) => {
                let g = Op::Activation(Activation::LeakyRelu { alpha });
                self.network.append(name, g, &[x])?
            }
        };
        match most {
            None => Ok(place),
            // A slope below zero would lead above the bound on both sides.
            Some(most) if most > 0.0 && alpha >= 0.0 => {
                self.network.clipped(name, place, f32::MIN, most)
            }
            Some(most) => Err(NetworkError::unsupported(
                name,
                format!("a ReLU of max_value {most} and negative_slope {alpha}"),
                "use a positive max_value and no negative slope below zero",
            )),
        }
    }

    fn expect_last_axis(
        &self,
        layer: &Layer<'_>,
        axis: &Value,
        x: usize,
    ) -> Result<(), NetworkError> {
        let axes = self.network.nodes[x].shape.len();
        let axis = match axis.as_array().map(Vec::as_slice) {
            Some([one]) => one,
            Some([]) => &Value::Null,
            _ => axis,
        };
        if axis.is_array() {
            return Err(NetworkError::unsupported(
                &layer.name,
                format!("the axes {axis}"),
                "use the last axis, -1",
            ));
        }
        if axis.is_null() || axis_of(&layer.name, axis, axes)? + 1 == axes {
            return Ok(());
        }
        Err(NetworkError::unsupported(
            &layer.name,
            format!("axis {axis}"),
            "use the last axis, -1",
        ))
    }
}
