//! TensorFlow Lite: float32 and float16, and int8 with its weights dequantised. Values between
//! layers are floating point here, so a quantised file gives what its weights say, without the
//! rounding of its values.

mod dense;
mod elementwise;
mod file;
mod flatbuffer;
mod names;
mod operators;
mod places;
mod recurrent;
mod reductions;
pub(super) mod rounding;
mod windows;

use std::collections::{HashMap, HashSet};

use super::tensor::Tensor;
use crate::{Network, NetworkError};
use file::{Model, Operator};

struct Import<'a> {
    network: Network,
    model: &'a Model<'a>,
    /// The node that holds each tensor.
    places: HashMap<i32, usize>,
    /// Tensors that say where a node is positive.
    signs: HashMap<i32, usize>,
    /// Tensors that are computed of nothing but shapes.
    shapes: HashSet<i32>,
}

/// # Errors
/// [`NetworkError`].
pub(super) fn import(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    let model = Model::new(bytes)?;
    recurrent::refuse(&model)?;
    if model.graphs > 1 {
        return Err(NetworkError::unsupported(
            "model",
            format!("{} graphs", model.graphs),
            "convert a model without loops or branches that depend on values",
        ));
    }
    let one = |list: &[i32], what: &str| match *list {
        [one] => Ok(one),
        _ => Err(NetworkError::unsupported(
            "model",
            format!("{} {what}s", list.len()),
            format!("concatenate the {what}s into one"),
        )),
    };
    let (input, output) = (one(&model.inputs, "input")?, one(&model.outputs, "output")?);
    let info = tensor(&model, input)?;
    if !info.is_number {
        return Err(NetworkError::unsupported(
            last(&info.name),
            "an input of integers",
            "convert a model that reads float32",
        ));
    }
    if info.open || info.shape.first().is_some_and(|&batch| batch > 1) && info.shape.len() > 1 {
        return Err(NetworkError::unsupported(
            last(&info.name),
            format!(
                "an input of shape {:?}{}",
                info.shape,
                if info.open {
                    ", open beside the batch"
                } else {
                    ""
                }
            ),
            "a batch of 1 and fixed axes after it work",
        ));
    }
    let shape = info.shape.get(1..).unwrap_or(&[]).to_vec();
    let input_name = if info.name.is_empty() {
        "input"
    } else {
        &info.name
    };
    let mut import = Import {
        network: Network::new(name, input_name, shape),
        model: &model,
        places: HashMap::from([(input, 0)]),
        signs: HashMap::new(),
        shapes: HashSet::new(),
    };
    for operator in &model.operators {
        import.operator(operator)?;
    }
    let place = import.places.get(&output).copied();
    let place =
        place.ok_or_else(|| NetworkError::malformed("model", "no operator gives the output"))?;
    let mut network = import.network;
    network.nodes.truncate(place + 1);
    network.drop_unread();
    Ok(network)
}

fn tensor<'a>(model: &'a Model<'_>, index: i32) -> Result<&'a file::TensorInfo, NetworkError> {
    let found = usize::try_from(index)
        .ok()
        .and_then(|index| model.tensors.get(index));
    found.ok_or_else(|| NetworkError::malformed("model", format!("there is no tensor {index}")))
}

/// Names of fused layers are joined by `;`, the last being that of the layer.
fn last(name: &str) -> &str {
    name.rsplit(';').next().unwrap_or(name)
}

impl Import<'_> {
    fn free_name(&self, name: &str) -> String {
        let own = last(name).trim_matches(char::is_control);
        let name = if own.is_empty() { "layer" } else { own };
        let taken = |name: &str| self.network.nodes.iter().any(|node| node.name == name);
        let mut free: String = name.chars().filter(|c| !c.is_control()).take(200).collect();
        let mut number = 2;
        while taken(&free) {
            free = format!("{name} {number}");
            number += 1;
        }
        free
    }

    /// The node at an input.
    fn value(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let index = operator.inputs.get(input).copied().unwrap_or(-1);
        self.places.get(&index).copied().ok_or_else(|| {
            if self.shapes.contains(&index) {
                let what = "a value that is computed of a shape";
                return NetworkError::unsupported(name, what, "use constants");
            }
            if self
                .constant(operator, input)
                .is_ok_and(|found| found.is_some())
            {
                let what = "a constant where a value is expected";
                return NetworkError::unsupported(name, what, "compute it before converting");
            }
            NetworkError::malformed(
                name,
                format!("it reads tensor {index}, which no operator before it gives"),
            )
        })
    }

    /// The weights at an input, also where they are widened first.
    fn constant(
        &self,
        operator: &Operator<'_>,
        input: usize,
    ) -> Result<Option<&Tensor>, NetworkError> {
        let Some(&index) = operator.inputs.get(input).filter(|&&index| index >= 0) else {
            return Ok(None);
        };
        let info = tensor(self.model, index)?;
        if info.constant.is_some() {
            return Ok(info.constant.as_ref());
        }
        let widened = self
            .model
            .operators
            .iter()
            .find(|o| o.code == 6 && o.outputs.first() == Some(&index));
        match widened.and_then(|operator| operator.inputs.first()) {
            Some(&source) => Ok(tensor(self.model, source)?.constant.as_ref()),
            None => Ok(None),
        }
    }

    fn weights(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<&Tensor, NetworkError> {
        self.constant(operator, input)?.ok_or_else(|| {
            NetworkError::unsupported(name, "weights that are computed", "convert a trained model")
        })
    }

    fn bias(
        &self,
        operator: &Operator<'_>,
        count: usize,
        name: &str,
    ) -> Result<Vec<f32>, NetworkError> {
        match self.constant(operator, 2)? {
            Some(bias) => {
                bias.expect_shape(name, &[count])?;
                Ok(bias.values.clone())
            }
            None if operator.inputs.get(2).is_none_or(|&index| index < 0) => Ok(vec![0.0; count]),
            None => Err(NetworkError::unsupported(
                name,
                "a bias that is computed, or of integers without a scale",
                "convert a trained model",
            )),
        }
    }
}

/// Number of values of a shape.
fn product(shape: &[usize]) -> usize {
    shape.iter().fold(1, |n, &axis| n.saturating_mul(axis))
}

/// A tensor's shape as a node holds it: without the batch of 1, and flat where no node has so many
/// axes.
fn held(shape: &[usize], length: usize) -> Vec<usize> {
    let inner = match shape {
        [1, inner @ ..] if !inner.is_empty() => inner,
        other => other,
    };
    let fits = (1..=3).contains(&inner.len()) && product(inner) == length;
    if fits { inner.to_vec() } else { vec![length] }
}
