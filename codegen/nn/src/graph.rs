//! A network as a directed graph without cycles, with shapes checked.

use super::layer::Op;
use super::{NetworkError, limits, shape};

/// A network: nodes in an order in which each follows what it reads.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Name of the crate: lower-case letters, digits, `-`.
    pub name: String,
    /// The first is the input, the last the output.
    pub nodes: Vec<Node>,
    /// Inputs and the outputs that another program gives for them, each a sequence of calls from a
    /// network at rest.
    pub golden: Vec<Golden>,
}

/// One layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Name in the imported file.
    pub name: String,
    /// Operation of the node.
    pub op: Op,
    /// Indices of the nodes that it reads.
    pub from: Vec<usize>,
    /// Shape of the output: features; steps and features; or rows, columns and channels.
    pub shape: Vec<usize>,
}

impl Node {
    /// Number of values of the output.
    #[must_use]
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns true if the output is empty, as that of no valid node is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Calls from a network at rest: inputs in turn, and the output after the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Golden {
    /// One input after another, each flattened with the last axis running fastest.
    pub x: Vec<f32>,
    /// The output after the last.
    pub y: Vec<f64>,
}

impl Network {
    /// A network that has only its input.
    #[must_use]
    pub fn new(name: &str, input: &str, shape: Vec<usize>) -> Self {
        Self {
            name: name.into(),
            nodes: vec![Node {
                name: input.into(),
                op: Op::Input,
                from: Vec::new(),
                shape,
            }],
            golden: Vec::new(),
        }
    }

    /// Adds a node, its shape found and checked, and gives its place.
    ///
    /// # Errors
    /// [`NetworkError`] if the layer does not fit what it reads.
    pub fn push(&mut self, name: &str, op: Op, from: Vec<usize>) -> Result<usize, NetworkError> {
        let place = self.nodes.len();
        if place >= limits::MAX_NODES {
            return Err(NetworkError::too_large(
                name,
                format!("the network has more than {} layers", limits::MAX_NODES),
            ));
        }
        let mut inputs = Vec::new();
        for &from in &from {
            let node = self.nodes.get(from).ok_or_else(|| {
                NetworkError::malformed(name, "it reads a layer that does not come before it")
            })?;
            inputs.push(node.shape.as_slice());
        }
        let shape = shape::infer(name, &op, &inputs)?;
        self.nodes.push(Node {
            name: name.into(),
            op,
            from,
            shape,
        });
        Ok(place)
    }

    /// Number of values of one input.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.nodes.first().map_or(0, Node::len)
    }

    /// Number of values of the output.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.nodes.last().map_or(0, Node::len)
    }

    /// Number of values that are kept from one call to the next.
    #[must_use]
    pub fn state(&self) -> usize {
        self.nodes.iter().map(|node| node.op.state()).sum()
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.nodes.iter().map(|node| node.op.parameters()).sum()
    }
}
