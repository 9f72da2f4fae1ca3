//! Layers that only scale and shift, folded into one operation.

use super::Import;
use super::values::{numbers, stated};
use crate::import::composite::Length;
use crate::import::keras::config::Layer;
use crate::import::shapes;
use crate::{NetworkError, Op};

impl Import<'_> {
    pub(super) fn batch_norm(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
    ) -> Result<usize, NetworkError> {
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
        let epsilon = match &layer.config["epsilon"] {
            value if value.is_null() => 1e-3,
            value => value.as_f64().ok_or_else(|| {
                NetworkError::unsupported(
                    &layer.name,
                    format!("epsilon = {value}"),
                    "a number works",
                )
            })?,
        };
        let op = normalise([&gamma, &beta, &mean, &variance], epsilon);
        self.push(&layer.name, op, x)
    }

    /// Each run of the last axis by its own mean and variance, then scaled by channel.
    pub(super) fn layer_norm(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        self.expect_last_axis(layer, &config["axis"], x)?;
        if config["rms_scaling"].as_bool() == Some(true) {
            return Err(NetworkError::unsupported(
                name,
                "rms_scaling=True",
                "use rms_scaling=False, or RMSNormalization",
            ));
        }
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let tensors = [("gamma", "scale", 1.0), ("beta", "center", 0.0)];
        let [gain, offset] = self.gains(layer, tensors, channels)?;
        let epsilon = stated(name, "epsilon", &config["epsilon"])?.unwrap_or(1e-3);
        let normal = self.push(name, Op::Normalise { epsilon }, x)?;
        self.network.of_each(name, normal, gain, offset)
    }

    /// The gain and offset of a normalisation, by channel, in the order in which Keras stores them.
    fn gains<const N: usize>(
        &self,
        layer: &Layer<'_>,
        tensors: [(&str, &str, f32); N],
        channels: usize,
    ) -> Result<[Vec<f32>; N], NetworkError> {
        let mut number = 0;
        let mut found = [const { Vec::new() }; N];
        for (values, (tensor, key, otherwise)) in found.iter_mut().zip(tensors) {
            if layer.config[key].as_bool() == Some(false) {
                *values = vec![otherwise; channels];
                continue;
            }
            let tensor = self.weights.get(layer, tensor, number)?;
            number += 1;
            tensor.expect_shape(&layer.name, &[channels])?;
            values.clone_from(&tensor.values);
        }
        Ok(found)
    }

    /// Each group of channels by its own mean and variance, then scaled by channel.
    pub(super) fn group_norm(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        self.expect_last_axis(layer, &config["axis"], x)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let groups = match config["groups"].as_i64() {
            Some(-1) => channels,
            groups => groups.map_or(32, |groups| usize::try_from(groups).unwrap_or(0)),
        };
        let epsilon = stated(name, "epsilon", &config["epsilon"])?.unwrap_or(1e-3);
        let tensors = [("gamma", "scale", 1.0), ("beta", "center", 0.0)];
        let [gain, offset] = self.gains(layer, tensors, channels)?;
        if self.network.nodes[x].shape.len() > 1 {
            self.refuse_sequence(layer, x)?;
        }
        let normal = self.network.grouped(name, x, groups, epsilon)?;
        self.network.by_channel(name, normal, gain, offset)
    }

    /// Each run of the last axis by the root of the mean of its squares, then scaled by channel.
    pub(super) fn rms_norm(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        self.expect_last_axis(layer, &config["axis"], x)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let epsilon = stated(name, "epsilon", &config["epsilon"])?.unwrap_or(1e-6);
        let [gain] = self.gains(layer, [("scale", "scale", 1.0)], channels)?;
        let length = Length::Mean(epsilon);
        let normal = self.network.by_length(name, x, channels, length)?;
        let offset = vec![0.0; channels];
        self.network.by_channel(name, normal, gain, offset)
    }

    /// Each run of the last axis at length 1.
    pub(super) fn unit_norm(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        // Keras 2 holds the sum of squares above 1e-12, Keras 3 the length.
        let least = if self.keras_2 { 1e-12 } else { 1e-24 };
        self.of_unit_length(layer, x, least)
    }

    /// As [`Self::unit_norm`], the sum of squares at least `least`.
    pub(super) fn of_unit_length(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
        least: f32,
    ) -> Result<usize, NetworkError> {
        self.expect_last_axis(layer, &layer.config["axis"], x)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let length = Length::Sum(least);
        self.network.by_length(&layer.name, x, channels, length)
    }

    /// A slope for each value, or for each along the axes that are not shared.
    pub(super) fn prelu(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = &layer.name;
        // What is shared shows in the shape of the slopes.
        let _ = &layer.config["shared_axes"];
        let alpha = self.weights.get(layer, "alpha", 0)?;
        let shape = &self.network.nodes[x].shape;
        let slopes = shapes::spread(name, &alpha.shape, &alpha.values, shape)?;
        self.network.prelu(name, x, &slopes)
    }

    pub(super) fn normalization(
        &mut self,
        layer: &Layer<'_>,
        x: usize,
    ) -> Result<usize, NetworkError> {
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
        if layer.config["invert"].as_bool() == Some(true) {
            let op = Op::Scale {
                gain: variance.iter().map(|v| (1.0 / gain(v)) as f32).collect(),
                offset: mean,
            };
            return self.push(&layer.name, op, x);
        }
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

    pub(super) fn rescaling(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let number = |key: &str, otherwise| {
            let value = &layer.config[key];
            // Keras 3 writes an array as an object.
            let value = if value.is_object() {
                &value["config"]["value"]
            } else {
                value
            };
            let values = numbers(value);
            match values.len() {
                0 if layer.config[key].is_null() => Ok(vec![otherwise; channels]),
                0 => Err(NetworkError::unsupported(
                    &layer.name,
                    format!("{key} = {}", layer.config[key]),
                    "numbers work",
                )),
                1 => Ok(vec![values[0]; channels]),
                _ => Ok(values),
            }
        };
        let op = Op::Scale {
            gain: number("scale", 1.0)?,
            offset: number("offset", 0.0)?,
        };
        self.push(&layer.name, op, x)
    }
}

/// Batch normalisation as a scale: `gamma (x - mean) / sqrt(variance + epsilon) + beta`.
pub(in crate::import) fn normalise([gamma, beta, mean, variance]: [&[f32]; 4], epsilon: f64) -> Op {
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
