//! Dense layers: Gemm and MatMul with constant weights.

use super::{Import, Node, Value};
use crate::import::tensor::Tensor;
use crate::{Convolution, Dense, NetworkError, Op, Window};

impl Import<'_> {
    /// `W x + b` for `weights` of shape `[outputs][inputs]`, over the last axis.
    pub(super) fn dense(
        &mut self,
        node: &Node<'_>,
        weights: Tensor,
        bias: Vec<f32>,
    ) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
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

    pub(super) fn gemm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        node.expect_int("transA", 0, "use transA = 0")?;
        let (alpha, beta) = (node.float("alpha", 1.0), node.float("beta", 1.0));
        let mut weights = self.needed(node, 1)?.clone();
        weights.expect_axes(&node.name, 2)?;
        if node.int("transB", 0) == 0 {
            weights = weights.transposed(&node.name)?;
        }
        weights.values.iter_mut().for_each(|w| *w *= alpha);
        let outputs = weights.shape[0];
        let bias = match self.weights(node, 2)? {
            None => vec![0.0; outputs],
            Some(bias) if bias.values.len() == outputs && bias.shape.last() == Some(&outputs) => {
                bias.values.iter().map(|b| beta * b).collect()
            }
            Some(bias) if bias.values.len() == 1 => vec![beta * bias.values[0]; outputs],
            Some(bias) => {
                return Err(node.malformed(format!(
                    "bias of shape {:?} for {outputs} outputs",
                    bias.shape
                )));
            }
        };
        self.dense(node, weights, bias)
    }

    pub(super) fn matmul(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let mut weights = self.needed(node, 1)?.clone();
        // A vector gives a value without the axis; axes of 1 before the matrix change nothing.
        let vector = weights.shape.len() == 1;
        if vector {
            weights.shape.push(1);
        }
        while weights.shape.len() > 2 && weights.shape[0] == 1 {
            weights.shape.remove(0);
        }
        let weights = weights.transposed(&node.name)?;
        let bias = vec![0.0; weights.shape[0]];
        let mut found = self.dense(node, weights, bias)?;
        if let Some(value) = found.first_mut().filter(|_| vector) {
            let mut dims = value.dims();
            dims.pop();
            *value = value.reshaped(dims, value.batch);
        }
        Ok(found)
    }
}
