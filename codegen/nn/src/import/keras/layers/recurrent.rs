//! Layers that remember: SimpleRNN, GRU, LSTM.

use super::Import;
use super::values::activation_name;
use crate::import::keras::config::{Layer, expect_own};
use crate::import::keras::settings::{Settings, expect_float};
use crate::{Cell, NetworkError, Op, Recurrent};

/// Classes of recurrent layers.
pub(super) const RECURRENT: &[&str] = &["SimpleRNN", "GRU", "LSTM", "RNN"];

/// The class of the layer whose cell an RNN has.
fn cell_class(layer: &str, cell: &str) -> Result<&'static str, NetworkError> {
    match cell {
        "SimpleRNNCell" => Ok("SimpleRNN"),
        "GRUCell" => Ok("GRU"),
        "LSTMCell" => Ok("LSTM"),
        other => Err(NetworkError::unsupported(
            layer,
            format!("an RNN of {other}"),
            "SimpleRNNCell, GRUCell and LSTMCell work, stacks as one RNN after another",
        )),
    }
}

impl Import<'_> {
    /// The hidden state after the last step of the recurrent layer at `place`.
    pub(super) fn state(&mut self, layer: &Layer<'_>, place: usize) -> Result<usize, NetworkError> {
        let name = format!("{} state", layer.name);
        let &[steps, units] = self.network.nodes[place].shape.as_slice() else {
            return Ok(place);
        };
        let last = self.network.along(&name, place, 0, &[steps - 1])?;
        self.network.reshaped(&name, last, &[units])
    }

    pub(super) fn recurrent(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        self.cell(layer, layer.class, x)
    }

    /// A layer of one direction, of class `class`.
    fn cell(&mut self, layer: &Layer<'_>, class: &str, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        // An RNN has the settings of its cell in a layer of their own.
        let wrapped = match class {
            "RNN" => Some(config.inner("cell")),
            _ => None,
        };
        let class = match wrapped {
            None => class,
            Some(cell) => {
                let own = cell["class_name"].as_str().unwrap_or("");
                expect_own(name, own, cell)?;
                cell_class(name, own)?
            }
        };
        let inside = wrapped.map(|cell| Settings::new(&cell["config"]));
        if let Some(inside) = &inside {
            expect_float(name, &inside["dtype"])?;
        }
        let own = inside.as_ref().unwrap_or(config);
        let backward = config["go_backwards"].as_bool() == Some(true);
        if backward && self.streaming {
            return Err(NetworkError::unsupported(
                name,
                "go_backwards=True over a sequence of open length",
                "give the model a fixed number of steps, Input((steps, features))",
            ));
        }
        let g = self.activation(name, activation_name(name, own, "activation")?)?;
        let gates = || self.activation(name, activation_name(name, own, "recurrent_activation")?);
        let cell = match class {
            "SimpleRNN" => Cell::Simple { activation: g },
            "GRU" => Cell::Gru {
                activation: g,
                gates: gates()?,
                reset_after: own["reset_after"].as_bool().unwrap_or(false),
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
        let (bias, inner_bias) = if own["use_bias"].as_bool() == Some(false) {
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
        if let Some(inside) = &inside {
            inside.expect_read(name, class)?;
        }
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
        let x = if backward { self.reversed(name, x)? } else { x };
        self.network.append(name, op, &[x])
    }

    /// The steps of a sequence from the last to the first.
    fn reversed(&mut self, name: &str, x: usize) -> Result<usize, NetworkError> {
        match *self.network.nodes[x].shape.as_slice() {
            [steps, _] if steps > 1 => {
                let indices: Vec<usize> = (0..steps).rev().collect();
                let name = format!("{name} reversed");
                self.network.along(&name, x, 0, &indices)
            }
            _ => Ok(x),
        }
    }

    /// Two recurrent layers over the same sequence, the second from its end, joined.
    pub(super) fn both_ways(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let wrapped = |key: &str| config.inner(key);
        let (forward, given) = (wrapped("layer"), wrapped("backward_layer"));
        let join = match &config["merge_mode"] {
            mode if mode.is_null() => "null",
            mode => mode.as_str().unwrap_or("unknown"),
        };
        if !["concat", "sum", "ave", "mul"].contains(&join) {
            return Err(NetworkError::unsupported(
                name,
                format!("merge_mode = {join}"),
                "concat, sum, ave and mul work",
            ));
        }
        let mut places = Vec::new();
        for side in ["forward", "backward"] {
            let backward = side == "backward";
            let value = if backward && !given.is_null() {
                given
            } else {
                forward
            };
            let class = value["class_name"].as_str().unwrap_or("");
            if !RECURRENT.contains(&class) {
                return Err(NetworkError::unsupported(
                    name,
                    format!("{class} both ways"),
                    format!("Bidirectional works with {}", RECURRENT.join(", ")),
                ));
            }
            expect_own(name, class, value)?;
            expect_float(name, &value["config"]["dtype"])?;
            // The weights are found under the wrapper's own class, the cell is that of the layer.
            let inside = Layer {
                name: name.clone(),
                class: layer.class,
                config: Settings::new(&value["config"]),
                from: Vec::new(),
                operands: Vec::new(),
                key: layer.key,
                side,
                number: layer.number,
            };
            if self.streaming {
                return Err(NetworkError::unsupported(
                    name,
                    "Bidirectional over a sequence of open length",
                    "give the model a fixed number of steps, Input((steps, features))",
                ));
            }
            // Without a configuration of its own it is the first, turned round.
            let own = given.is_null();
            let turned = if backward && own {
                self.reversed(name, x)?
            } else {
                x
            };
            let place = self.cell(&inside, class, turned)?;
            if inside.config["return_state"].as_bool() == Some(true) {
                return Err(NetworkError::unsupported(
                    name,
                    "return_state=True both ways",
                    "use return_state=False, or two layers, one with go_backwards=True",
                ));
            }
            inside.config.expect_read(name, class)?;
            let sequences = inside.config["return_sequences"].as_bool() == Some(true);
            places.push(if backward && sequences {
                self.reversed(name, place)?
            } else {
                place
            });
        }
        let axis = self.network.nodes[places[0]].shape.len() - 1;
        match join {
            "concat" => self.network.append(name, Op::Concatenate(axis), &places),
            "sum" => self.network.append(name, Op::Add, &places),
            "mul" => self.network.append(name, Op::Multiply, &places),
            _ => {
                let sum = self.network.append(name, Op::Add, &places)?;
                self.network.scaled(name, sum, 0.5, 0.0)
            }
        }
    }
}
