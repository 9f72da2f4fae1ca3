//! The settings of a layer, with a record of those that were looked at: what is left is not
//! understood.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::ops::Index;

use serde_json::Value;

use crate::NetworkError;

/// Settings that change nothing in a trained network, or that the weights state as well.
const IDLE: &[&str] = &[
    "name",
    "trainable",
    "dtype",
    "batch_input_shape",
    "batch_shape",
    "build_input_shape",
    "units",
    "filters",
    "kernel_size",
    "rank",
    "momentum",
    "renorm_momentum",
    "renorm_clipping",
    "virtual_batch_size",
    "synchronized",
    "kernel_initializer",
    "bias_initializer",
    "recurrent_initializer",
    "beta_initializer",
    "gamma_initializer",
    "alpha_initializer",
    "depthwise_initializer",
    "pointwise_initializer",
    "moving_mean_initializer",
    "moving_variance_initializer",
    "kernel_regularizer",
    "bias_regularizer",
    "recurrent_regularizer",
    "beta_regularizer",
    "gamma_regularizer",
    "alpha_regularizer",
    "depthwise_regularizer",
    "pointwise_regularizer",
    "activity_regularizer",
    "kernel_constraint",
    "bias_constraint",
    "recurrent_constraint",
    "beta_constraint",
    "gamma_constraint",
    "alpha_constraint",
    "depthwise_constraint",
    "pointwise_constraint",
    "unit_forget_bias",
    "dropout",
    "recurrent_dropout",
    "seed",
    "unroll",
    "implementation",
    "zero_output_for_mask",
    "supports_masking",
    "input_dim",
    "input_length",
];

/// Settings that change nothing while they are false.
const IDLE_FALSE: &[&str] = &["renorm", "time_major", "fused", "keepdims"];

/// The settings of one layer.
pub(super) struct Settings<'a> {
    value: &'a Value,
    read: RefCell<BTreeSet<String>>,
}

impl Index<&str> for Settings<'_> {
    type Output = Value;

    fn index(&self, key: &str) -> &Value {
        self.read.borrow_mut().insert(key.into());
        &self.value[key]
    }
}

impl<'a> Settings<'a> {
    pub(super) fn new(value: &'a Value) -> Self {
        Self {
            value,
            read: RefCell::default(),
        }
    }

    /// A setting that is a layer of its own.
    pub(super) fn inner(&self, key: &str) -> &'a Value {
        self.read.borrow_mut().insert(key.into());
        &self.value[key]
    }

    /// Every setting has been looked at.
    ///
    /// # Errors
    /// One was not, and is not at a value that changes nothing.
    pub(super) fn expect_read(&self, layer: &str, class: &str) -> Result<(), NetworkError> {
        let read = self.read.borrow();
        let is_idle = |key: &str, value: &Value| {
            value.is_null()
                || read.contains(key)
                || IDLE.contains(&key)
                || (IDLE_FALSE.contains(&key) && value.as_bool() == Some(false))
        };
        let mut settings = self.value.as_object().into_iter().flatten();
        match settings.find(|(key, value)| !is_idle(key, value)) {
            None => Ok(()),
            Some((key, value)) => {
                let mut text = value.to_string();
                if text.len() > 60 {
                    text = text.chars().take(57).collect::<String>() + "...";
                }
                let known: Vec<&str> = read.iter().map(String::as_str).collect();
                Err(NetworkError::unsupported(
                    layer,
                    format!("the setting {key} = {text} of {class}"),
                    format!("{class} works with {}", known.join(", ")),
                ))
            }
        }
    }
}

/// The mode in which a layer was quantised; none where its dtype policy is one of floating point.
pub(super) fn quantised(dtype: &Value) -> Option<&str> {
    let quantised = dtype["class_name"].as_str() == Some("QuantizedDTypePolicy");
    quantised.then(|| dtype["config"]["mode"].as_str().unwrap_or("unknown"))
}

/// That a layer computes in float32 (or float64), or was quantised in a way that is read.
///
/// # Errors
/// Another dtype policy.
pub(super) fn expect_float(layer: &str, dtype: &Value) -> Result<(), NetworkError> {
    let config = &dtype["config"];
    let name = dtype
        .as_str()
        .or(config["name"].as_str())
        .or(config["source_name"].as_str());
    let class = dtype["class_name"].as_str().unwrap_or("DTypePolicy");
    let known = [
        "DTypePolicy",
        "FloatDTypePolicy",
        "Policy",
        "QuantizedDTypePolicy",
    ]
    .contains(&class);
    match name {
        None if dtype.is_null() => Ok(()),
        Some("float32" | "float64") if known => match quantised(dtype) {
            None | Some("int8") => Ok(()),
            Some(mode) => Err(NetworkError::unsupported(
                layer,
                format!("a layer quantised as {mode}"),
                "int8 works, and float32, from which the emitter quantises",
            )),
        },
        Some(name) if known => Err(NetworkError::unsupported(
            layer,
            format!("the dtype policy {name}"),
            "save the model in float32: keras.config.set_dtype_policy(\"float32\")",
        )),
        _ => Err(NetworkError::unsupported(
            layer,
            format!("the dtype policy {class}"),
            "save the model in float32",
        )),
    }
}
