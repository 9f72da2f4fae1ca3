//! The layers of a network. Adding a kind is a variant of [`Layer`], a kernel in the firmware and
//! an arm in `evaluate`, `emit::network` and `store`.

use std::fmt;

use super::SpecError;
use sinew_nn::{Cell, Recurrent};

/// One layer.
#[derive(Clone, Debug, PartialEq)]
pub enum Layer {
    /// Every output looks at every input.
    Dense(Dense),
    /// A GRU or an LSTM, one step a prediction; its hidden state lasts (docs/reference/networks.md,
    /// eq. 5 and 6). The first layer alone, with tanh, sigmoid gates, and a GRU's reset after its
    /// product.
    Recurrent(Recurrent),
}

/// `a = activation(W x + b)` (docs/reference/model-files.md, eq. 3).
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

/// Function of each output of a layer.
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
    /// [`ModelSpec::validate`](super::ModelSpec::validate) checks the length of the bias.
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
            Self::Recurrent(layer) => match layer.cell {
                Cell::Simple { .. } => "simple_rnn",
                Cell::Gru { .. } => "gru",
                Cell::Lstm { .. } => "lstm",
            },
        }
    }

    /// Length of the input.
    #[must_use]
    pub fn inputs(&self) -> usize {
        match self {
            Self::Dense(dense) => dense.inputs,
            Self::Recurrent(layer) => layer.inputs(),
        }
    }

    /// Length of the output.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Self::Dense(dense) => dense.outputs,
            Self::Recurrent(layer) => layer.units,
        }
    }

    /// Activation of a dense layer.
    #[must_use]
    pub fn activation(&self) -> Option<Activation> {
        match self {
            Self::Dense(dense) => Some(dense.activation),
            Self::Recurrent(_) => None,
        }
    }

    /// Values that last from one prediction to the next: h of a GRU, h and c of an LSTM.
    #[must_use]
    pub fn hidden_state_len(&self) -> usize {
        match self {
            Self::Dense(_) => 0,
            Self::Recurrent(layer) => layer.units.saturating_mul(layer.cell.vectors()),
        }
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        match self {
            Self::Dense(dense) => dense.weights.len() + dense.bias.len(),
            Self::Recurrent(_) => self
                .tensors()
                .iter()
                .map(|(_, _, values)| values.len())
                .sum(),
        }
    }

    /// The tensors: name in `weights.safetensors`, shape, values.
    #[must_use]
    pub fn tensors(&self) -> Vec<(&'static str, Vec<usize>, &Vec<f32>)> {
        match self {
            Self::Dense(dense) => vec![
                ("weights", vec![dense.outputs, dense.inputs], &dense.weights),
                ("bias", vec![dense.outputs], &dense.bias),
            ],
            Self::Recurrent(layer) => {
                let shapes = shapes(layer);
                let values = [
                    &layer.kernel,
                    &layer.recurrent,
                    &layer.bias,
                    &layer.inner_bias,
                ];
                let named = shapes.into_iter().zip(values);
                named
                    .map(|((name, shape), values)| (name, shape, values))
                    .collect()
            }
        }
    }

    /// As [`Layer::tensors`], to be filled.
    pub(crate) fn tensors_mut(&mut self) -> Vec<(&'static str, Vec<usize>, &mut Vec<f32>)> {
        match self {
            Self::Dense(dense) => vec![
                (
                    "weights",
                    vec![dense.outputs, dense.inputs],
                    &mut dense.weights,
                ),
                ("bias", vec![dense.outputs], &mut dense.bias),
            ],
            Self::Recurrent(layer) => {
                let shapes = shapes(layer);
                let values = [
                    &mut layer.kernel,
                    &mut layer.recurrent,
                    &mut layer.bias,
                    &mut layer.inner_bias,
                ];
                let named = shapes.into_iter().zip(values);
                named
                    .map(|((name, shape), values)| (name, shape, values))
                    .collect()
            }
        }
    }

    pub(super) fn validate(&self, layer: usize) -> Result<(), SpecError> {
        let shape = self.to_string();
        if let Self::Recurrent(recurrent) = self {
            let usual = recurrent.cell == gru_cell() || recurrent.cell == lstm_cell();
            if layer > 0 || !usual || !recurrent.streaming || recurrent.sequences {
                return Err(SpecError::Recurrent { layer, shape });
            }
        }
        for (tensor, lengths, values) in self.tensors() {
            // As many lengths as a tensor has; a huge one is refused by its number of values.
            let expected = lengths
                .iter()
                .fold(1, |n: usize, length| n.saturating_mul(*length));
            let tensor = match tensor {
                "kernel" => "kernel weights",
                "recurrent" => "recurrent weights",
                "bias" => "biases",
                "inner_bias" => "inner biases",
                weights => weights,
            };
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

/// `dense 12 -> 10, tanh`, `gru 20 -> 15`.
impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} -> {}", self.kind(), self.inputs(), self.outputs())?;
        match self.activation() {
            Some(activation) => write!(f, ", {}", activation.name()),
            None => Ok(()),
        }
    }
}

/// Names and shapes of the tensors of a recurrent layer; an LSTM has no inner bias.
fn shapes(layer: &Recurrent) -> Vec<(&'static str, Vec<usize>)> {
    let (gates, units) = (layer.cell.gates(), layer.units);
    let mut shapes = vec![
        ("kernel", vec![gates, units, layer.inputs()]),
        ("recurrent", vec![gates, units, units]),
        ("bias", vec![gates, units]),
    ];
    if let Cell::Gru { .. } = layer.cell {
        shapes.push(("inner_bias", vec![units]));
    }
    shapes
}

/// The GRU that a predictor may begin with.
#[must_use]
pub const fn gru_cell() -> Cell {
    Cell::Gru {
        activation: sinew_nn::Activation::Tanh,
        gates: sinew_nn::Activation::Sigmoid,
        reset_after: true,
    }
}

/// The LSTM that a predictor may begin with.
#[must_use]
pub const fn lstm_cell() -> Cell {
    Cell::Lstm {
        activation: sinew_nn::Activation::Tanh,
        gates: sinew_nn::Activation::Sigmoid,
    }
}

/// A recurrent first layer without weights, one step a prediction.
#[must_use]
pub const fn unfilled(cell: Cell, units: usize) -> Recurrent {
    Recurrent {
        cell,
        units,
        kernel: Vec::new(),
        recurrent: Vec::new(),
        bias: Vec::new(),
        inner_bias: Vec::new(),
        sequences: false,
        streaming: true,
    }
}
