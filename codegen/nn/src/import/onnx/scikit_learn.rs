//! Operators of the domain ai.onnx.ml that are layers: scaling of the inputs, and linear models.

use super::{Import, Node, Value};
use crate::import::tensor::Tensor;
use crate::{NetworkError, Op};

impl Import<'_> {
    /// # Errors
    /// [`NetworkError`].
    pub(super) fn of_scikit_learn(&mut self, node: &Node<'_>) -> Result<Value, NetworkError> {
        match node.proto.op_type.as_str() {
            "Scaler" => self.scaler(node),
            "LinearRegressor" => self.linear(node),
            other => Err(node.unsupported(
                format!("the operator {other} of ai.onnx.ml"),
                "Scaler, LinearRegressor and MLPRegressor work",
            )),
        }
    }

    /// `(x - offset) scale`.
    fn scaler(&mut self, node: &Node<'_>) -> Result<Value, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let channels = value.shape.last().copied().unwrap_or(1);
        let list = |name: &str, otherwise: f32| match node.floats(name) {
            [] => Ok(vec![otherwise; channels]),
            [one] => Ok(vec![*one; channels]),
            many if many.len() == channels => Ok(many.to_vec()),
            many => {
                Err(node.malformed(format!("{} of {name} for {channels} features", many.len())))
            }
        };
        let (offset, scale) = (list("offset", 0.0)?, list("scale", 1.0)?);
        let op = Op::Scale {
            offset: offset
                .iter()
                .zip(&scale)
                .map(|(o, s)| (-f64::from(*o) * f64::from(*s)) as f32)
                .collect(),
            gain: scale,
        };
        let place = self.push(node, op, value.place)?;
        Ok(Value { place, ..value })
    }

    fn linear(&mut self, node: &Node<'_>) -> Result<Value, NetworkError> {
        if !["", "NONE"].contains(&node.text("post_transform").as_str()) {
            return Err(node.unsupported(
                format!("the post_transform {}", node.text("post_transform")),
                "use NONE",
            ));
        }
        let targets = usize::try_from(node.int("targets", 1)).unwrap_or(0).max(1);
        let coefficients = node.floats("coefficients").to_vec();
        let inputs = coefficients.len() / targets;
        let bias = match node.floats("intercepts") {
            [] => vec![0.0; targets],
            list => list.to_vec(),
        };
        if bias.len() != targets {
            return Err(node.malformed(format!("{} intercepts for {targets} targets", bias.len())));
        }
        let weights = Tensor::new(&node.name, vec![targets, inputs], coefficients)?;
        let mut found = self.dense(node, weights, bias)?;
        found
            .pop()
            .ok_or_else(|| node.malformed("it gives nothing"))
    }
}
