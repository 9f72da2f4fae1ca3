//! Layers that remember: SimpleRNN, GRU, LSTM.

use super::Import;
use super::values::activation_name;
use crate::import::keras::config::Layer;
use crate::{Cell, NetworkError, Op, Recurrent};

impl Import<'_> {
    pub(super) fn recurrent(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
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
            crate::import::gru_bias(&bias.values, rows, units, reset_after)
        };
        let stateful = config["stateful"].as_bool() == Some(true);
        let steps = match self.network.nodes[x].shape.as_slice() {
            [steps, _] => *steps,
            _ => 1,
        };
        if stateful && steps > 1 {
            return Err(NetworkError::unsupported(
                name,
                format!("stateful=True over {steps} steps a call"),
                "give it one step a call, or stateful=False",
            ));
        }
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
