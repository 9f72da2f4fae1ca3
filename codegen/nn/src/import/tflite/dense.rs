//! Dense layers: FULLY_CONNECTED with constant weights.

use super::Import;
use super::file::Operator;
use crate::{Convolution, Dense, NetworkError, Op, Window};

impl Import<'_> {
    pub(super) fn dense(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 2)?;
        if operator.options.map_or(Ok(0), |options| options.byte(1))? != 0 {
            return Err(NetworkError::unsupported(
                name,
                "shuffled weights",
                "convert without shuffling",
            ));
        }
        let inputs = weights.shape[1].max(1);
        let outputs = weights.shape[0];
        let bias = self.bias(operator, outputs, name)?;
        let weights = weights.values.clone();
        let length = self.network.nodes[x].len();
        if length == inputs || !length.is_multiple_of(inputs) {
            return self
                .network
                .push(name, Op::Dense(Dense { weights, bias }), vec![x]);
        }
        // The same weights at every row.
        let mut from = x;
        let shape = &self.network.nodes[x].shape;
        if shape.last() != Some(&inputs) || !(2..=3).contains(&shape.len()) {
            let rows = Op::Reshape(vec![length / inputs, inputs]);
            from = self
                .network
                .push(&self.free_name(&format!("{name} rows")), rows, vec![x])?;
        }
        let window = Window {
            size: [1; 2],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let op = Op::Convolution(Convolution {
            window,
            weights,
            bias,
        });
        self.network.push(name, op, vec![from])
    }
}
