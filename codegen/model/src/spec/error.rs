//! Errors of a specification.

use super::Role;

/// Error of a [`ModelSpec`](super::ModelSpec). [`SpecError::key`] is its place in `model.toml`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// The name cannot be a package's name.
    #[error(
        "model name {name:?} is refused: use 1 to {max} lower-case letters, digits and `-`, \
         beginning with a letter and not ending with `-`"
    )]
    Name {
        /// As given.
        name: String,
        /// Longest accepted.
        max: usize,
    },
    /// A scalar setting out of its range.
    #[error("{key} is {value}: expected {expected}")]
    Value {
        /// Path of the key in `model.toml`.
        key: String,
        /// As given.
        value: String,
        /// Accepted values.
        expected: String,
    },
    /// Too few or too many signals of one role.
    #[error("the model has {found} {role}s: expected {min} to {max}")]
    SignalCount {
        /// Whose count.
        role: Role,
        /// As given.
        found: usize,
        /// Fewest accepted.
        min: usize,
        /// Most accepted.
        max: usize,
    },
    /// A name or unit that is empty, too long or not printable.
    #[error(
        "{role} {index} has the {what} {text:?}: expected 1 to {max} printable characters on one line"
    )]
    SignalText {
        /// Role of the list.
        role: Role,
        /// Place in the list.
        index: usize,
        /// `name` or `unit`.
        what: &'static str,
        /// As given.
        text: String,
        /// Longest accepted.
        max: usize,
    },
    /// Two signals with one name.
    #[error("the name {name:?} of {role} {index} is used twice: names are unique in a model")]
    DuplicateName {
        /// Role of the list.
        role: Role,
        /// Place of the second one.
        index: usize,
        /// The name.
        name: String,
    },
    /// A scaling that does not scale.
    #[error(
        "{role} {name:?} has span {span:?}: expected a positive number that f32 can hold, \
         since model units are (physical - offset) / span"
    )]
    Span {
        /// Role of the list.
        role: Role,
        /// Place in the list.
        index: usize,
        /// The signal.
        name: String,
        /// As given.
        span: f64,
    },
    /// An offset that is not a number.
    #[error("{role} {name:?} has offset {offset:?}: expected a number that f32 can hold")]
    Offset {
        /// Role of the list.
        role: Role,
        /// Place in the list.
        index: usize,
        /// The signal.
        name: String,
        /// As given.
        offset: f64,
    },
    /// A regressor that no frame can carry.
    #[error("the regressor has {found} values ({composition}): at most {max} fit a frame")]
    RegressorTooLong {
        /// Its length.
        found: usize,
        /// Composition of the regressor.
        composition: String,
        /// Longest accepted.
        max: usize,
    },
    /// Too few or too many layers.
    #[error("the network has {found} layers: expected 1 to {max}")]
    LayerCount {
        /// As given.
        found: usize,
        /// Most accepted.
        max: usize,
    },
    /// A layer too small or too large to be meant.
    #[error("layer {layer} ({shape}) is {width} wide: expected 1 to {max}")]
    Width {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
        /// Its number of outputs.
        width: usize,
        /// Widest accepted.
        max: usize,
    },
    /// More parameters than any board holds.
    #[error("the network has {found} parameters: at most {max} fit the flash of a board")]
    Parameters {
        /// Their number.
        found: usize,
        /// Most accepted.
        max: usize,
    },
    /// The first layer does not fit the regressor.
    #[error(
        "layer 0 ({shape}) takes {found} values, but the regressor has {expected}: {composition}"
    )]
    RegressorMismatch {
        /// The layer in words.
        shape: String,
        /// Length of the layer's input.
        found: usize,
        /// The regressor's length.
        expected: usize,
        /// Composition of the regressor.
        composition: String,
    },
    /// A layer does not fit the one before it.
    #[error("layer {layer} ({shape}) takes {found} values, but layer {} gives {expected}", layer - 1)]
    Chain {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
        /// Length of the layer's input.
        found: usize,
        /// Length of the output of the layer before it.
        expected: usize,
    },
    /// The last layer does not fit the outputs.
    #[error(
        "layer {layer} ({shape}), the last, gives {found} values, but the model has {expected} outputs"
    )]
    OutputMismatch {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
        /// Length of the layer's output.
        found: usize,
        /// The number of outputs.
        expected: usize,
    },
    /// A recurrent layer that no predictor has.
    #[error(
        "layer {layer} ({shape}): a gru or lstm has to be the first layer, with tanh, sigmoid gates, one step a call \
         and, in a gru, the reset after the product"
    )]
    Recurrent {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
    },
    /// A recurrent layer whose state would be the output.
    #[error(
        "layer {layer} ({shape}) is the last: expected a dense layer after it, which gives the outputs"
    )]
    RecurrentLast {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
    },
    /// A tensor does not have as many values as its shape says.
    #[error("layer {layer} ({shape}) has {found} {tensor}: expected {expected}")]
    TensorLength {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
        /// `weights` or `biases`.
        tensor: &'static str,
        /// As given.
        found: usize,
        /// By the layer's shape.
        expected: usize,
    },
    /// A weight that is not a number.
    #[error(
        "layer {layer} ({shape}): value {index} of its {tensor} is {value}, not a finite number"
    )]
    NonFinite {
        /// Index of the layer.
        layer: usize,
        /// The layer in words.
        shape: String,
        /// `weights` or `biases`.
        tensor: &'static str,
        /// Place in the tensor, row after row.
        index: usize,
        /// NaN or an infinity.
        value: f32,
    },
    /// The skip connection does not fit the regressor and the outputs.
    #[error(
        "the skip connection has {found} weights: expected {expected}, a regressor for each output"
    )]
    SkipLength {
        /// As given.
        found: usize,
        /// Outputs times regressor.
        expected: usize,
    },
    /// A skip connection around a network whose last layer is not linear.
    #[error("layer {layer} ({shape}), the last, has to be linear where there is a skip connection")]
    SkipActivation {
        /// The last layer.
        layer: usize,
        /// The layer in words.
        shape: String,
    },
    /// A weight of the skip connection that is not a number.
    #[error("weight {index} of the skip connection is {value}, not a finite number")]
    SkipNonFinite {
        /// Place, row after row.
        index: usize,
        /// NaN or an infinity.
        value: f32,
    },
    /// A list of the control problem has the wrong length.
    #[error("control.{key} has {found} values: expected {expected}, one for each {role}")]
    ControlLength {
        /// The list.
        key: &'static str,
        /// As given.
        found: usize,
        /// The number of signals.
        expected: usize,
        /// Of which signals.
        role: Role,
    },
    /// A reference vector of the wrong shape.
    #[error("golden vector {index} has {found} values of {what}: expected {expected}")]
    GoldenLength {
        /// Index of the vector.
        index: usize,
        /// `x` or `y`.
        what: &'static str,
        /// As given.
        found: usize,
        /// By the model's shape.
        expected: usize,
    },
    /// A reference vector that these weights do not produce: they belong to another network, or
    /// the inputs are in another order.
    #[error(
        "golden vector {index}: output {output} is {expected} where the network gives {found}; \
         the weights or the order of the inputs are not those that made it"
    )]
    GoldenDisagrees {
        /// Index of the vector.
        index: usize,
        /// Index of the output.
        output: usize,
        /// By the vector.
        expected: f64,
        /// By the network, in double precision.
        found: f64,
    },
}

impl SpecError {
    /// Path to the cause in `model.toml`: keys and list indices, outermost first. Empty if
    /// it is not there but in the weights.
    #[must_use]
    pub fn key(&self) -> Vec<String> {
        let path = |parts: &[&str]| parts.iter().map(ToString::to_string).collect();
        match self {
            Self::Name { .. } => path(&["name"]),
            Self::Value { key, .. } => key.split('.').map(String::from).collect(),
            Self::SignalCount { role, .. } => path(&[role.name()]),
            Self::SignalText {
                role, index, what, ..
            } => path(&[role.name(), &index.to_string(), what]),
            Self::DuplicateName { role, index, .. } => {
                path(&[role.name(), &index.to_string(), "name"])
            }
            Self::Span { role, index, .. } => path(&[role.name(), &index.to_string(), "span"]),
            Self::Offset { role, index, .. } => path(&[role.name(), &index.to_string(), "offset"]),
            Self::RegressorTooLong { .. } => path(&["past_inputs"]),
            Self::LayerCount { .. } | Self::Parameters { .. } => path(&["layer"]),
            Self::RegressorMismatch { .. } => path(&["layer", "0", "inputs"]),
            Self::Chain { layer, .. } => path(&["layer", &layer.to_string(), "inputs"]),
            Self::Width { layer, .. } | Self::OutputMismatch { layer, .. } => {
                path(&["layer", &layer.to_string(), "outputs"])
            }
            Self::ControlLength { key, .. } => path(&["control", key]),
            Self::Recurrent { layer, .. } | Self::RecurrentLast { layer, .. } => {
                path(&["layer", &layer.to_string(), "kind"])
            }
            Self::SkipActivation { layer, .. } => {
                path(&["layer", &layer.to_string(), "activation"])
            }
            Self::SkipLength { .. }
            | Self::SkipNonFinite { .. }
            | Self::TensorLength { .. }
            | Self::NonFinite { .. }
            | Self::GoldenLength { .. }
            | Self::GoldenDisagrees { .. } => Vec::new(),
        }
    }
}
