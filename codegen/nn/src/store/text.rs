//! The description `network.toml` as serde reads and prints it.

use serde::{Deserialize, Serialize};

use crate::{Activation, Window};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Text {
    pub(super) format: String,
    pub(super) name: String,
    pub(super) input: InputText,
    pub(super) layer: Vec<LayerText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputText {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
}

/// A layer; it reads the one before it unless `from` names others.
#[derive(Serialize, Deserialize)]
pub(super) struct LayerText {
    pub(super) name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) from: Option<Vec<String>>,
    #[serde(flatten)]
    pub(super) kind: Kind,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(super) enum Kind {
    Dense,
    Convolution {
        #[serde(flatten)]
        window: WindowText,
    },
    MaxPool {
        #[serde(flatten)]
        window: WindowText,
    },
    AveragePool {
        #[serde(flatten)]
        window: WindowText,
        #[serde(default)]
        count_padding: bool,
    },
    Reshape {
        shape: Vec<usize>,
    },
    Permute {
        axes: Vec<usize>,
    },
    Scale,
    Activation {
        #[serde(flatten)]
        function: Function,
    },
    Softmax,
    LogSoftmax,
    SimpleRnn {
        activation: Function,
        sequences: bool,
        streaming: bool,
    },
    Gru {
        activation: Function,
        gates: Function,
        reset_after: bool,
        sequences: bool,
        streaming: bool,
    },
    Lstm {
        activation: Function,
        gates: Function,
        sequences: bool,
        streaming: bool,
    },
    Add,
    Multiply,
    Maximum,
    Minimum,
    Select {
        shape: Vec<usize>,
        places: Vec<i64>,
    },
    Normalise {
        epsilon: f32,
    },
    Concatenate {
        axis: usize,
    },
}

#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct WindowText {
    pub(super) size: [usize; 2],
    #[serde(default = "ones")]
    pub(super) stride: [usize; 2],
    #[serde(default = "ones")]
    pub(super) dilation: [usize; 2],
    #[serde(default)]
    pub(super) before: [usize; 2],
    #[serde(default)]
    pub(super) after: [usize; 2],
}

fn ones() -> [usize; 2] {
    [1; 2]
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(tag = "function", rename_all = "snake_case")]
pub(super) enum Function {
    Linear,
    Relu,
    LeakyRelu { alpha: f32 },
    Elu { alpha: f32, scale: f32 },
    Gelu,
    GeluTanh,
    Softplus,
    Softsign,
    Swish,
    HardSigmoid { alpha: f32, beta: f32 },
    Clip { low: f32, high: f32 },
    Sigmoid,
    Tanh,
    Exponential,
    Logarithm,
    Root,
    Reciprocal,
}

macro_rules! same_names {
    ($value:expr, $from:ident => $to:ident) => {
        match $value {
            $from::Linear => $to::Linear,
            $from::Relu => $to::Relu,
            $from::LeakyRelu { alpha } => $to::LeakyRelu { alpha },
            $from::Elu { alpha, scale } => $to::Elu { alpha, scale },
            $from::Gelu => $to::Gelu,
            $from::GeluTanh => $to::GeluTanh,
            $from::Softplus => $to::Softplus,
            $from::Softsign => $to::Softsign,
            $from::Swish => $to::Swish,
            $from::HardSigmoid { alpha, beta } => $to::HardSigmoid { alpha, beta },
            $from::Clip { low, high } => $to::Clip { low, high },
            $from::Sigmoid => $to::Sigmoid,
            $from::Tanh => $to::Tanh,
            $from::Exponential => $to::Exponential,
            $from::Logarithm => $to::Logarithm,
            $from::Root => $to::Root,
            $from::Reciprocal => $to::Reciprocal,
        }
    };
}

impl From<Function> for Activation {
    fn from(function: Function) -> Self {
        same_names!(function, Function => Activation)
    }
}

impl From<Activation> for Function {
    fn from(activation: Activation) -> Self {
        same_names!(activation, Activation => Function)
    }
}

impl From<WindowText> for Window {
    fn from(text: WindowText) -> Self {
        let WindowText {
            size,
            stride,
            dilation,
            before,
            after,
        } = text;
        Self {
            size,
            stride,
            dilation,
            before,
            after,
        }
    }
}

impl From<Window> for WindowText {
    fn from(window: Window) -> Self {
        let Window {
            size,
            stride,
            dilation,
            before,
            after,
        } = window;
        Self {
            size,
            stride,
            dilation,
            before,
            after,
        }
    }
}
