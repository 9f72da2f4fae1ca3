//! Dense layers: Gemm and MatMul with constant weights.

use super::{Import, Node, Value};
use crate::import::tensor::Tensor;
use crate::{Convolution, Dense, NetworkError, Op, Window};

impl Import<'_> {
    /// `W x + b` of the first input over its last axis, for `weights` of shape `[outputs][inputs]`.
    pub(super) fn dense(
        &mut self,
        node: &Node<'_>,
        weights: Tensor,
        bias: Vec<f32>,
    ) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        self.dense_of(node, value, weights, bias)
    }

    fn dense_of(
        &mut self,
        node: &Node<'_>,
        value: Value,
        weights: Tensor,
        bias: Vec<f32>,
    ) -> Result<Vec<Value>, NetworkError> {
        let mut value = self.as_written(node, value)?;
        let outputs = bias.len();
        let mut dims = value.dims();
        if value.batch.is_some_and(|batch| batch + 1 == dims.len()) && dims.len() > 1 {
            // The last axis holds one feature, and is no batch.
            let batch = dims
                .iter()
                .position(|&n| n == 1)
                .filter(|&axis| axis + 1 < dims.len());
            value = value.reshaped(dims.clone(), batch);
            if batch.is_none() {
                value.shape = dims.clone();
                value.batch = None;
            }
        }
        let Some(last) = dims.last_mut() else {
            return Err(node.malformed("it reads a value without axes"));
        };
        let inputs = *last;
        if weights.shape.get(1) != Some(&inputs) {
            return Err(node.malformed(format!(
                "weights of {} inputs for a value of {inputs}",
                weights.shape.get(1).copied().unwrap_or(0)
            )));
        }
        *last = outputs;
        let rows = value.len() / inputs.max(1);
        let weights = weights.values;
        let op = if rows == 1 {
            Op::Dense(Dense { weights, bias })
        } else {
            let window = Window {
                size: [1; 2],
                stride: [1; 2],
                dilation: [1; 2],
                before: [0; 2],
                after: [0; 2],
            };
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            })
        };
        let mut from = value.place;
        if rows > 1 {
            let whole = (2..=3).contains(&value.shape.len()) && value.shape.last() == Some(&inputs);
            let held = if whole {
                value.shape.clone()
            } else {
                vec![rows, inputs]
            };
            from = self.held_as(node, from, held)?;
        }
        let place = self.push(node, op, from)?;
        Ok(vec![Value::of(place, dims, value.batch)])
    }

    /// `alpha A B + beta C`, where A or B is constant.
    pub(super) fn gemm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let (alpha, beta) = (node.float("alpha", 1.0), node.float("beta", 1.0));
        let turned = [node.int("transA", 0) != 0, node.int("transB", 0) != 0];
        let left = self.is_weights(node, 0);
        self.expect_weights(node)?;
        let (constant, operand) = if left { (0, 1) } else { (1, 0) };
        let mut weights = self.needed(node, constant)?.clone();
        weights.expect_axes(&node.name, 2)?;
        // As `[outputs][inputs]`: B has the inputs first, A the outputs.
        if turned[constant] == left {
            weights = weights.transposed(&node.name)?;
        }
        weights.values.iter_mut().for_each(|w| *w *= alpha);
        let outputs = weights.shape[0];
        let along = if left { 0 } else { 1 };
        let bias = match self.weights(node, 2)? {
            None => vec![0.0; outputs],
            Some(bias) if bias.values.len() == 1 => vec![beta * bias.values[0]; outputs],
            Some(bias) => {
                let ahead = 2_usize.saturating_sub(bias.shape.len());
                let place = along.max(ahead) - ahead;
                let fits = along >= ahead && bias.shape.get(place) == Some(&outputs);
                if bias.values.len() != outputs || !fits {
                    let message = format!("bias of shape {:?} for {outputs} outputs", bias.shape);
                    return Err(node.malformed(message));
                }
                bias.values.iter().map(|b| beta * b).collect()
            }
        };
        let mut value = self.value(node, operand)?;
        if value.dims().len() != 2 {
            return Err(node.malformed(format!("a Gemm of shape {:?}", value.dims())));
        }
        // Its features go last.
        if turned[operand] != left {
            value = self.transposed(node, value, &[1, 0])?;
        }
        let mut found = self.dense_of(node, value, weights, bias)?;
        if let (Some(value), true) = (found.first_mut(), left) {
            *value = self.transposed(node, value.clone(), &[1, 0])?;
        }
        Ok(found)
    }

    /// True if an input of a node is weights.
    fn is_weights(&self, node: &Node<'_>, input: usize) -> bool {
        self.constants.contains_key(node.input(input).unwrap_or(""))
    }

    /// That one of two matrices is constant.
    fn expect_weights(&self, node: &Node<'_>) -> Result<(), NetworkError> {
        if self.is_weights(node, 0) || self.is_weights(node, 1) {
            return Ok(());
        }
        let what = format!("{} of two values, as in attention,", node.proto.op_type);
        Err(node.unsupported(what, "one matrix has to be constant; the nearest is GRU"))
    }

    pub(super) fn matmul(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        self.expect_weights(node)?;
        let left = self.is_weights(node, 0);
        let mut weights = self.needed(node, usize::from(!left))?.clone();
        // A vector gives a value without the axis; axes of 1 before the matrix change nothing.
        let vector = weights.shape.len() == 1;
        if vector {
            weights.shape.insert(if left { 0 } else { 1 }, 1);
        }
        let value = self.value(node, usize::from(left))?;
        let axes = value.dims().len();
        while weights.shape.len() > 2 && weights.shape[0] == 1 {
            weights.shape.remove(0);
        }
        if weights.shape.len() > 2 || axes == 0 {
            let what = format!("MatMul with weights of shape {:?}", weights.shape);
            return Err(node.unsupported(what, "one matrix for all works, and Conv with groups"));
        }
        weights.expect_axes(&node.name, 2)?;
        if !left {
            let weights = weights.transposed(&node.name)?;
            let bias = vec![0.0; weights.shape[0]];
            let found = self.dense_of(node, value, weights, bias)?;
            return Ok(without_axis(found, vector, 1));
        }
        let bias = vec![0.0; weights.shape[0]];
        if axes == 1 {
            let found = self.dense_of(node, value, weights, bias)?;
            return Ok(without_axis(found, vector, 1));
        }
        let mut swapped: Vec<usize> = (0..axes).collect();
        swapped.swap(axes - 2, axes - 1);
        let value = self.transposed(node, value, &swapped)?;
        let mut found = self.dense_of(node, value, weights, bias)?;
        for value in &mut found {
            *value = self.transposed(node, value.clone(), &swapped)?;
        }
        Ok(without_axis(found, vector, 2))
    }
}

/// A value without the axis of length 1, the `number`th from the end, where a vector made it.
fn without_axis(mut found: Vec<Value>, vector: bool, number: usize) -> Vec<Value> {
    if let Some(value) = found.first_mut().filter(|_| vector) {
        let mut dims = value.dims();
        dims.remove(dims.len().saturating_sub(number));
        *value = value.reshaped(dims, value.batch);
    }
    found
}
