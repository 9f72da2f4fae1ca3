//! A network as a directed graph without cycles, with shapes checked.

use super::layer::Op;
use super::{NetworkError, limits, shape};

/// Network: a directed acyclic graph of nodes, in an order in which each follows the nodes that it
/// reads.
///
/// Importers make networks; a program can also build one. [`push`](Self::push) infers and checks
/// the shape of each layer.
///
/// ```
/// use sinew_nn::{Activation, Dense, Network, Op, evaluate};
///
/// // y = x + W tanh(x): a dense layer with a skip connection around it.
/// let mut network = Network::new("residual", "x", vec![2]);
/// let tanh = network.push("tanh", Op::Activation(Activation::Tanh), vec![0])?;
/// let dense = Dense { weights: vec![0.5, 0.0, 0.0, -0.5], bias: vec![0.0, 0.0] };
/// let dense = network.push("dense", Op::Dense(dense), vec![tanh])?;
/// network.push("sum", Op::Add, vec![0, dense])?;
/// network.validate()?;
///
/// assert_eq!((network.inputs(), network.outputs(), network.parameters()), (2, 2, 6));
/// let jacobian = evaluate::jacobian(&network, &[0.0, 0.0], &[]);
/// assert_eq!(jacobian, [[1.5, 0.0], [0.0, 0.5]]);
///
/// // A layer that does not fit is refused by its name.
/// let short = Dense { weights: vec![1.0], bias: vec![0.0] };
/// let error = network.push("short", Op::Dense(short), vec![0]).unwrap_err();
/// assert!(error.to_string().starts_with("short: "));
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
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

/// Node of a network: a layer.
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

/// Golden vector: inputs of calls in turn, from a network at rest, and the output after the last
/// call.
///
/// ```
/// use sinew_nn::{Activation, Golden, Network, Op};
///
/// let mut network = Network::new("tanh", "x", vec![1]);
/// network.push("tanh", Op::Activation(Activation::Tanh), vec![0])?;
/// network.golden.push(Golden { x: vec![0.0], y: vec![0.0] });
/// network.validate()?;
/// network.golden.push(Golden { x: vec![0.0], y: vec![1.0] });
/// assert!(network.validate().is_err(), "tanh(0) is 0");
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Golden {
    /// One input after another, each flattened with the last axis running fastest.
    pub x: Vec<f32>,
    /// Output after the last call.
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

    /// Returns true if the emitted crate has tables of numbers: weights, or places.
    #[must_use]
    pub(crate) fn has_tables(&self) -> bool {
        let selects = |node: &Node| matches!(node.op, Op::Select(_));
        self.parameters() > 0 || self.nodes.iter().any(selects)
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.nodes.iter().map(|node| node.op.parameters()).sum()
    }
}
