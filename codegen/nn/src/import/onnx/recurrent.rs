//! RNN, GRU and LSTM of ONNX.

use super::constant::Constant;
use super::{Import, Node, Value};
use crate::import::shapes::places_along;
use crate::import::{gru_bias, tensor::Tensor};
use crate::{Activation, Cell, NetworkError, Op, Recurrent};

impl Import<'_> {
    pub(super) fn recurrent(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let &[steps, 1, inputs] = dims.as_slice() else {
            return Err(node.unsupported(
                format!("a sequence of shape {dims:?}"),
                "steps, a batch of 1 and features work",
            ));
        };
        self.refuse(node, steps)?;
        let value = if value.batch == Some(1) {
            value
        } else {
            self.flat(node, value)?.reshaped(dims, Some(1))
        };
        let value = self.as_written(node, value)?;
        let directions: &[bool] = match node.text("direction").as_str() {
            "" | "forward" => &[false],
            "reverse" => &[true],
            "bidirectional" => &[false, true],
            other => return Err(node.malformed(format!("the direction {other:?}"))),
        };
        let mut all = Vec::new();
        let mut lasts = Vec::new();
        let mut units = 0;
        let cells = cells(node, directions.len())?;
        for (direction, &reverse) in directions.iter().enumerate() {
            let mut layer = self.layer(
                node,
                inputs,
                [direction, directions.len()],
                cells[direction],
            )?;
            units = layer.units;
            let reverse = reverse && steps > 1;
            if reverse && self.streaming {
                return Err(node.unsupported(
                    "a layer that runs backward over an open number of steps",
                    "export with a fixed number of steps",
                ));
            }
            let reads = |output: usize| {
                node.proto
                    .output
                    .get(output)
                    .is_some_and(|name| self.is_read(name))
            };
            let (reads_all, reads_last) = (reads(0), reads(1));
            layer.sequences = reads_all;
            let from = if reverse {
                self.backward(node, value.place, steps, inputs)?
            } else {
                value.place
            };
            let place = self.push(node, Op::Recurrent(layer), from)?;
            let last = if reads_all && reads_last && steps > 1 {
                let length = steps * units;
                let places: Vec<usize> = (length - units..length).collect();
                self.selection(node, place, &places)?
            } else {
                place
            };
            lasts.push(last);
            all.push(if reverse && reads_all {
                self.backward(node, place, steps, units)?
            } else {
                place
            });
        }
        // The directions side by side: [steps, directions, 1, units] and [directions, 1, units].
        if let [forward, backward] = *all.as_slice() {
            let sides = [(forward, backward), (lasts[0], lasts[1])].map(|(a, b)| vec![a, b]);
            for (list, from) in [&mut all, &mut lasts].into_iter().zip(sides) {
                let name = self.free_name(&node.name);
                let axis = self.network.nodes[from[0]].shape.len() - 1;
                *list = vec![self.network.push(&name, Op::Concatenate(axis), from)?];
            }
        }
        let count = directions.len();
        Ok(vec![
            Value::of(all[0], vec![steps, count, 1, units], Some(2)),
            Value::of(lasts[0], vec![count, 1, units], Some(1)),
        ])
    }

    /// A sequence from its end to its beginning.
    fn backward(
        &mut self,
        node: &Node<'_>,
        place: usize,
        steps: usize,
        width: usize,
    ) -> Result<usize, NetworkError> {
        let indices: Vec<usize> = (0..steps).rev().collect();
        let places = places_along(&[steps, width], 0, &indices);
        let place = self.selection(node, place, &places)?;
        self.held_as(node, place, vec![steps, width])
    }

    /// One direction's weights.
    fn layer(
        &mut self,
        node: &Node<'_>,
        inputs: usize,
        [direction, directions]: [usize; 2],
        cell: Cell,
    ) -> Result<Recurrent, NetworkError> {
        // ONNX's gates in the order of ours.
        let order: &[usize] = match node.proto.op_type.as_str() {
            "RNN" => &[0],
            "GRU" => &[0, 1, 2],
            _ => &[0, 2, 3, 1],
        };
        let gates = order.len();
        let part = |values: &[f32], length: usize| values[direction * length..][..length].to_vec();
        let weights = self.needed(node, 1)?;
        weights.expect_axes(&node.name, 3)?;
        let units = weights.shape[1] / gates;
        let stated = node.int("hidden_size", units as i64);
        if stated != units as i64 {
            return Err(
                node.malformed(format!("hidden_size {stated} for weights of {units} units"))
            );
        }
        weights.expect_shape(&node.name, &[directions, gates * units, inputs])?;
        let kernel = gathered(
            &part(&weights.values, gates * units * inputs),
            order,
            units * inputs,
        );
        let weights = self.needed(node, 2)?;
        weights.expect_shape(&node.name, &[directions, gates * units, units])?;
        let recurrent = gathered(
            &part(&weights.values, gates * units * units),
            order,
            units * units,
        );
        let bias = match self.weights(node, 3)? {
            Some(bias) => {
                bias.expect_shape(&node.name, &[directions, 2 * gates * units])?;
                part(&bias.values, 2 * gates * units)
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
        Ok(Recurrent {
            cell,
            units,
            kernel,
            recurrent,
            bias,
            inner_bias,
            sequences: false,
            streaming: self.streaming,
        })
    }

    /// Returns true if anything reads a name; found when the graph was read.
    fn is_read(&self, name: &str) -> bool {
        self.read.contains(name)
    }

    fn refuse(&self, node: &Node<'_>, steps: usize) -> Result<(), NetworkError> {
        node.expect_int("layout", 0, "use layout = 0")?;
        node.expect_int("input_forget", 0, "use input_forget = 0")?;
        node.expect_int("output_sequence", 1, "read the first output")?;
        if node.float("clip", 0.0) != 0.0 {
            return Err(node.unsupported("clip", "leave clip out"));
        }
        if let Some(name) = node.input(4) {
            let whole = match self.constants.get(name) {
                Some(Constant::Integers(lengths)) => {
                    lengths.values.iter().all(|&n| n == steps as i64)
                }
                _ => false,
            };
            if !whole {
                return Err(node.unsupported("sequence_lens", "leave it out"));
            }
        }
        let rest = |tensor: &Tensor| tensor.values.iter().all(|&value| value == 0.0);
        for input in 5..7 {
            let computed = node
                .input(input)
                .filter(|name| self.values.contains_key(name));
            if computed.is_some() {
                return Err(node.unsupported("a first state that is computed", "start from zero"));
            }
            if !self.weights(node, input)?.is_none_or(rest) {
                return Err(node.unsupported("a first state other than zero", "start from zero"));
            }
        }
        if !self.weights(node, 7)?.is_none_or(rest) {
            return Err(node.unsupported("peepholes", "leave them out"));
        }
        Ok(())
    }
}

/// The kind of each direction, with its activations; alpha and beta go to those that take them, in
/// turn.
fn cells(node: &Node<'_>, directions: usize) -> Result<Vec<Cell>, NetworkError> {
    let names = node.texts("activations");
    let mut alphas = node.floats("activation_alpha").iter().copied();
    let mut betas = node.floats("activation_beta").iter().copied();
    let mut found = Vec::new();
    for name in &names {
        let mut alpha = |otherwise: f32| alphas.next().unwrap_or(otherwise);
        found.push(match name.to_lowercase().as_str() {
            "tanh" => Activation::Tanh,
            "sigmoid" => Activation::Sigmoid,
            "relu" => Activation::Relu,
            "softsign" => Activation::Softsign,
            "leakyrelu" => Activation::LeakyRelu { alpha: alpha(0.01) },
            "elu" => Activation::Elu {
                alpha: alpha(1.0),
                scale: 1.0,
            },
            "hardsigmoid" => Activation::HardSigmoid {
                alpha: alpha(0.2),
                beta: betas.next().unwrap_or(0.5),
            },
            _ => {
                return Err(node.unsupported(
                    format!("the activation {name}"),
                    "Tanh, Sigmoid, Relu, LeakyRelu, Elu, Softsign and HardSigmoid work",
                ));
            }
        });
    }
    if alphas.next().is_some() || betas.next().is_some() {
        return Err(node.unsupported(
            "an activation_alpha or activation_beta that no activation takes",
            "leave it out",
        ));
    }
    let (tanh, sigmoid) = (Activation::Tanh, Activation::Sigmoid);
    let defaults: &[Activation] = match node.proto.op_type.as_str() {
        "RNN" => &[tanh],
        "GRU" => &[sigmoid, tanh],
        _ => &[sigmoid, tanh, tanh],
    };
    if found.is_empty() {
        found = defaults.repeat(directions);
    }
    if found.len() != defaults.len() * directions {
        let message = format!("{} activations for {directions} directions", found.len());
        return Err(node.malformed(message));
    }
    let reset_after = node.proto.op_type == "GRU" && node.int("linear_before_reset", 0) != 0;
    let cell = |g: &[Activation]| match *g {
        [activation] => Ok(Cell::Simple { activation }),
        [gates, activation] => Ok(Cell::Gru {
            gates,
            activation,
            reset_after,
        }),
        [gates, activation, output] if activation == output => Ok(Cell::Lstm { gates, activation }),
        _ => Err(node.unsupported("two activations of cell and candidate", "use one for both")),
    };
    found.chunks(defaults.len()).map(cell).collect()
}

/// Blocks of `length` values in another order.
fn gathered(values: &[f32], order: &[usize], length: usize) -> Vec<f32> {
    order
        .iter()
        .flat_map(|&block| values[block * length..][..length].iter().copied())
        .collect()
}
