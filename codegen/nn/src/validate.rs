//! The checks of a finished network. Everything after them relies on what they hold.

use std::collections::HashSet;

use super::limits::{MAX_GOLDEN, MAX_NAME, MAX_NODES, MAX_PARAMETERS};
use super::{Network, NetworkError, Op, evaluate, shape};

/// A golden vector may differ from the network in double precision by this much of 1 + |y|: the
/// tools that supply them compute in f32 themselves.
const GOLDEN_TOLERANCE: f64 = 1e-4;

impl Network {
    /// Checks names, order, shapes, finite weights and the golden vectors.
    ///
    /// # Errors
    /// The first [`NetworkError`].
    pub fn validate(&self) -> Result<(), NetworkError> {
        if !is_package_name(&self.name) {
            return Err(NetworkError::malformed(
                "name",
                format!(
                    "{:?}: use up to 64 lower-case letters, digits and `-`, beginning with a letter",
                    self.name
                ),
            ));
        }
        if let [] | [_] = self.nodes[..] {
            let what = "a network without a layer beside its input";
            return Err(NetworkError::unsupported(
                "network",
                what,
                "give it a layer with weights or an activation",
            ));
        }
        if self.nodes.len() > MAX_NODES {
            let message = format!("{} layers: expected 2 to {MAX_NODES}", self.nodes.len());
            return Err(NetworkError::too_large("network", message));
        }
        let mut names = HashSet::new();
        for (place, node) in self.nodes.iter().enumerate() {
            if node.name.is_empty() || node.name.len() > 256 || node.name.contains(char::is_control)
            {
                let message = format!("layer {place} has the name {:?}", node.name);
                return Err(NetworkError::malformed("network", message));
            }
            if !names.insert(&node.name) {
                return Err(NetworkError::malformed(
                    &node.name,
                    "two layers have this name",
                ));
            }
            if place == 0 {
                if node.op != Op::Input || !node.from.is_empty() {
                    return Err(NetworkError::malformed(
                        &node.name,
                        "the first layer is the input",
                    ));
                }
                shape::check(&node.name, &node.shape)?;
                continue;
            }
            if node.from.iter().any(|&from| from >= place) {
                let message = "it reads itself or a layer after it: the layers form a cycle";
                return Err(NetworkError::malformed(&node.name, message));
            }
            let inputs: Vec<&[usize]> = node
                .from
                .iter()
                .map(|&from| self.nodes[from].shape.as_slice())
                .collect();
            let shape = shape::infer(&node.name, &node.op, &inputs)?;
            if shape != node.shape {
                let message = format!("its shape is {:?}: expected {shape:?}", node.shape);
                return Err(NetworkError::malformed(&node.name, message));
            }
            for (tensor, values) in node.op.tensors() {
                if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                    let message = format!("value {index} of its {tensor} is {}", values[index]);
                    return Err(NetworkError::malformed(&node.name, message));
                }
            }
        }
        if self.parameters() > MAX_PARAMETERS {
            let message = format!("{} parameters: at most {MAX_PARAMETERS}", self.parameters());
            return Err(NetworkError::too_large("network", message));
        }
        self.validate_golden()
    }

    fn validate_golden(&self) -> Result<(), NetworkError> {
        if self.golden.len() > MAX_GOLDEN {
            let message = format!("{} golden vectors: at most {MAX_GOLDEN}", self.golden.len());
            return Err(NetworkError::too_large("golden", message));
        }
        for (index, golden) in self.golden.iter().enumerate() {
            let place = format!("golden vector {index}");
            let calls = golden.x.len() / self.inputs();
            let whole = golden.x.len() == calls * self.inputs() && calls > 0;
            if !whole || (calls > 1 && self.state() == 0) || golden.y.len() != self.outputs() {
                let message = format!(
                    "{} inputs and {} outputs: expected {} and {}",
                    golden.x.len(),
                    golden.y.len(),
                    self.inputs(),
                    self.outputs()
                );
                return Err(NetworkError::malformed(place, message));
            }
            let x: Vec<f64> = golden.x.iter().copied().map(f64::from).collect();
            let y = evaluate::run(self, &x);
            for (output, (&expected, &found)) in golden.y.iter().zip(&y).enumerate() {
                let close = (expected - found).abs() <= GOLDEN_TOLERANCE * (1.0 + found.abs());
                // Written so that a NaN on either side is not close.
                if !close {
                    let message = format!(
                        "output {output} is {expected} where the network gives {found}; \
                         the weights or the order of the inputs are not those that made it"
                    );
                    return Err(NetworkError::malformed(place, message));
                }
            }
        }
        Ok(())
    }
}

/// Lower-case letters, digits and `-`, beginning with a letter: a name that a crate may have.
#[must_use]
pub fn is_package_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    name.len() <= MAX_NAME
        && name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(allowed)
        && !name.ends_with('-')
}
