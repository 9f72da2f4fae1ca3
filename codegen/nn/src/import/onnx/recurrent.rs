//! RNN, GRU and LSTM of ONNX.

use super::{Import, Node, Value};
use crate::import::{gru_bias, tensor::Tensor};
use crate::{Activation, Cell, NetworkError, Op, Recurrent};

impl Import<'_> {
    pub(super) fn recurrent(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        self.refuse(node)?;
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let &[steps, inputs] = value.shape.as_slice() else {
            return Err(node.malformed(format!(
                "it reads {:?}: expected steps, batch, features",
                value.shape
            )));
        };
        if value.batch != 1 {
            return Err(node.malformed("it reads the batch elsewhere than at axis 1"));
        }
        // ONNX's gates in the order of ours.
        let order: &[usize] = match node.proto.op_type.as_str() {
            "RNN" => &[0],
            "GRU" => &[0, 1, 2],
            _ => &[0, 2, 3, 1],
        };
        let gates = order.len();
        let weights = self.needed(node, 1)?;
        weights.expect_axes(&node.name, 3)?;
        let units = weights.shape[1] / gates;
        weights.expect_shape(&node.name, &[1, gates * units, inputs])?;
        let kernel = gathered(&weights.values, order, units * inputs);
        let weights = self.needed(node, 2)?;
        weights.expect_shape(&node.name, &[1, gates * units, units])?;
        let recurrent = gathered(&weights.values, order, units * units);
        let cell = cell(node)?;
        let bias = match self.weights(node, 3)? {
            Some(bias) => {
                bias.expect_shape(&node.name, &[1, 2 * gates * units])?;
                bias.values.clone()
            }
            None => vec![0.0; 2 * gates * units],
        };
        let (input, state) = bias.split_at(gates * units);
        let both = [gathered(input, order, units), gathered(state, order, units)].concat();
        let (bias, inner_bias) = match cell {
            Cell::Gru {
                reset_after: true, ..
            } => gru_bias(&both, gates * units, units, true),
            _ => {
                let (input, state) = both.split_at(gates * units);
                (
                    input.iter().zip(state).map(|(a, b)| a + b).collect(),
                    Vec::new(),
                )
            }
        };
        let streaming = self.streaming;
        // The last state is that of a layer of its own only where somebody reads it and nobody the others.
        let sequences = node
            .proto
            .output
            .first()
            .is_some_and(|name| self.is_read(name));
        let op = Op::Recurrent(Recurrent {
            cell,
            units,
            kernel,
            recurrent,
            bias,
            inner_bias,
            sequences,
            streaming,
        });
        let place = self.push(node, op, value.place)?;
        let all = Value {
            place,
            shape: vec![steps, 1, units],
            batch: 2,
            last: false,
            gelu: None,
        };
        let last = Value {
            place,
            shape: vec![1, units],
            batch: 1,
            last: false,
            gelu: None,
        };
        if sequences
            && node
                .proto
                .output
                .get(1)
                .is_some_and(|name| self.is_read(name))
            && steps > 1
        {
            return Err(
                node.unsupported("reading both all states and the last", "read one of them")
            );
        }
        Ok(vec![all, last])
    }

    /// Returns true if anything reads a name; found when the graph was read.
    fn is_read(&self, name: &str) -> bool {
        self.read.contains(name)
    }

    fn refuse(&self, node: &Node<'_>) -> Result<(), NetworkError> {
        let direction = node.text("direction");
        if !["", "forward"].contains(&direction.as_str()) {
            return Err(node.unsupported(format!("the direction {direction}"), "use forward"));
        }
        node.expect_int("layout", 0, "use layout = 0")?;
        node.expect_int("input_forget", 0, "use input_forget = 0")?;
        if node.float("clip", 0.0) != 0.0 {
            return Err(node.unsupported("clip", "leave clip out"));
        }
        for (input, what) in [(4, "sequence_lens"), (7, "peepholes")] {
            if node
                .proto
                .input
                .get(input)
                .is_some_and(|name| !name.is_empty())
            {
                return Err(node.unsupported(what, "leave it out"));
            }
        }
        for input in 5..7 {
            let rest = |tensor: &Tensor| tensor.values.iter().all(|&value| value == 0.0);
            if !self.weights(node, input)?.is_none_or(rest) {
                return Err(node.unsupported("a first state", "it starts at zero"));
            }
        }
        Ok(())
    }
}

fn cell(node: &Node<'_>) -> Result<Cell, NetworkError> {
    let names = node.texts("activations");
    let named = |place: usize, otherwise: Activation| -> Result<Activation, NetworkError> {
        Ok(match names.get(place).map(String::as_str) {
            None => otherwise,
            Some("Tanh") => Activation::Tanh,
            Some("Sigmoid") => Activation::Sigmoid,
            Some("Relu") => Activation::Relu,
            Some("HardSigmoid") => Activation::HardSigmoid {
                alpha: 0.2,
                beta: 0.5,
            },
            Some(other) => {
                let what = format!("the activation {other}");
                return Err(node.unsupported(what, "Tanh, Sigmoid, Relu and HardSigmoid work"));
            }
        })
    };
    let (tanh, sigmoid) = (Activation::Tanh, Activation::Sigmoid);
    Ok(match node.proto.op_type.as_str() {
        "RNN" => Cell::Simple {
            activation: named(0, tanh)?,
        },
        "GRU" => Cell::Gru {
            gates: named(0, sigmoid)?,
            activation: named(1, tanh)?,
            reset_after: node.int("linear_before_reset", 0) != 0,
        },
        _ => {
            let activation = named(1, tanh)?;
            if named(2, tanh)? != activation {
                return Err(
                    node.unsupported("two activations of cell and candidate", "use one for both")
                );
            }
            Cell::Lstm {
                gates: named(0, sigmoid)?,
                activation,
            }
        }
    })
}

/// Blocks of `length` values in another order.
fn gathered(values: &[f32], order: &[usize], length: usize) -> Vec<f32> {
    order
        .iter()
        .flat_map(|&block| values[block * length..][..length].iter().copied())
        .collect()
}
