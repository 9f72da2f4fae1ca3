//! Trained weights as layers of a controller model.

use crate::network_table::FirstLayer;
use sinew_ident::error::{Error, Result};
use sinew_model::spec::{Activation, Dense, Layer, gru_cell, lstm_cell, unfilled};
use sinew_nn::Recurrent;

use super::fold::Folded;

/// Layers of a controller model from folded weights.
///
/// # Errors
/// Weights that are no layer, such as some that are not finite.
pub fn layers(folded: &Folded) -> Result<Vec<Layer>> {
    let last = folded.layers.len() - 1;
    let remembering = folded.remembering.as_ref().map(|layer| {
        let cell = match folded.first {
            FirstLayer::Lstm => lstm_cell(),
            _ => gru_cell(),
        };
        let layer = layer.clone();
        Ok(Layer::Recurrent(Recurrent {
            kernel: layer.kernel,
            recurrent: layer.recurrent,
            bias: layer.bias,
            inner_bias: layer.inner_bias,
            ..unfilled(cell, layer.units)
        }))
    });
    let dense = folded.layers.iter().enumerate().map(|(i, (rows, bias))| {
        let activation = match folded.first {
            _ if i == last => Activation::Linear,
            FirstLayer::Relu if i == 0 => Activation::Relu,
            _ => Activation::Tanh,
        };
        Dense::from_rows(rows, bias.clone(), activation)
            .map(Layer::Dense)
            .map_err(|e| Error::failed(format!("layer {i} of the trained network: {e}")))
    });
    remembering.into_iter().chain(dense).collect()
}
