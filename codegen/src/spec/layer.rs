//! The layers of a network. Adding a kind is a variant of [`Layer`], a kernel in the firmware and
//! an arm in `evaluate`, `emit::network` and `store`.

use std::fmt;

use super::SpecError;

/// One layer.
#[derive(Clone, Debug, PartialEq)]
pub enum Layer {
    /// Every output looks at every input.
    Dense(Dense),
}

/// `a = activation(W x + b)` (docs/codegen.md, eq. 3).
#[derive(Clone, Debug, PartialEq)]
pub struct Dense {
    /// Length of `x`.
    pub inputs: usize,
    /// Length of `a`.
    pub outputs: usize,
    /// `W`, row after row: `outputs` rows of `inputs`.
    pub weights: Vec<f32>,
    /// `b`, one for each output.
    pub bias: Vec<f32>,
    /// The function applied to each output.
    pub activation: Activation,
}

/// What is applied to each output of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// Nothing.
    Linear,
    /// Hyperbolic tangent.
    Tanh,
    /// `max(0, z)`, with derivative 0 at 0.
    Relu,
}

/// Rows of a weight matrix that do not have the same length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("row {row} of the weights has {found} values where row 0 has {expected}")]
pub struct RowsError {
    /// The first row that differs.
    pub row: usize,
    /// Its length.
    pub found: usize,
    /// The length of row 0.
    pub expected: usize,
}

impl Activation {
    /// Every activation, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Tanh, Self::Relu];

    /// The activation's name in `model.toml`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Tanh => "tanh",
            Self::Relu => "relu",
        }
    }
}

impl Dense {
    /// A layer from the rows of its matrix, one row for each output.
    ///
    /// Whether the bias fits is found out by [`ModelSpec::validate`](super::ModelSpec::validate).
    ///
    /// # Errors
    /// [`RowsError`] if the rows differ in length.
    pub fn from_rows(
        rows: &[Vec<f32>],
        bias: Vec<f32>,
        activation: Activation,
    ) -> Result<Self, RowsError> {
        let inputs = rows.first().map_or(0, Vec::len);
        for (row, values) in rows.iter().enumerate() {
            if values.len() != inputs {
                return Err(RowsError {
                    row,
                    found: values.len(),
                    expected: inputs,
                });
            }
        }
        Ok(Self {
            inputs,
            outputs: rows.len(),
            weights: rows.concat(),
            bias,
            activation,
        })
    }

    /// The weights of one output.
    pub fn rows(&self) -> impl Iterator<Item = &[f32]> {
        // A validated layer has inputs >= 1; the max keeps an unvalidated one from panicking.
        self.weights.chunks(self.inputs.max(1))
    }
}

impl Layer {
    /// The kind's name in `model.toml`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Dense(_) => "dense",
        }
    }

    /// Length of what the layer takes.
    #[must_use]
    pub fn inputs(&self) -> usize {
        match self {
            Self::Dense(dense) => dense.inputs,
        }
    }

    /// Length of what the layer gives.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Self::Dense(dense) => dense.outputs,
        }
    }

    /// What is applied to each output.
    #[must_use]
    pub fn activation(&self) -> Activation {
        match self {
            Self::Dense(dense) => dense.activation,
        }
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        match self {
            Self::Dense(dense) => dense.weights.len() + dense.bias.len(),
        }
    }

    pub(super) fn validate(&self, layer: usize) -> Result<(), SpecError> {
        let Self::Dense(dense) = self;
        let shape = self.to_string();
        for (tensor, values, expected) in [
            (
                "weights",
                &dense.weights,
                dense.inputs.saturating_mul(dense.outputs),
            ),
            ("biases", &dense.bias, dense.outputs),
        ] {
            if values.len() != expected {
                return Err(SpecError::TensorLength {
                    layer,
                    shape,
                    tensor,
                    found: values.len(),
                    expected,
                });
            }
            if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                return Err(SpecError::NonFinite {
                    layer,
                    shape,
                    tensor,
                    index,
                    value: values[index],
                });
            }
        }
        Ok(())
    }
}

/// `dense 12 -> 10, tanh`.
impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} {} -> {}, {}",
            self.kind(),
            self.inputs(),
            self.outputs(),
            self.activation().name()
        )
    }
}
