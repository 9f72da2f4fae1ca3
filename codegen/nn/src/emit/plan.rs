//! Buffers of the layers' values, and the layers that work in place.

use super::names::identifiers;
use crate::{Network, Node, Op};

/// Rows of a Jacobian that one pass backward makes, where there are more results than these.
pub(super) const BLOCK: usize = 4;

/// A network with what the printers need to know about it.
pub(super) struct Plan<'a> {
    pub(super) network: &'a Network,
    /// Identifier of each node.
    pub(super) names: Vec<String>,
    /// The node in whose buffer each node's values lie: itself, or one before it.
    pub(super) buffer: Vec<usize>,
}

impl<'a> Plan<'a> {
    /// The network is valid.
    pub(super) fn new(network: &'a Network) -> Self {
        let names = identifiers(network.nodes.iter().map(|node| node.name.as_str()));
        let mut readers = vec![0; network.nodes.len()];
        for node in &network.nodes {
            for &from in &node.from {
                readers[from] += 1;
            }
        }
        let mut buffer: Vec<usize> = Vec::new();
        let last = network.nodes.len() - 1;
        for (place, node) in network.nodes.iter().enumerate() {
            let own = match (&node.op, node.from.first()) {
                // A network that only reshapes still has a result of its own.
                (Op::Reshape(_), Some(&from)) if place != last || buffer[from] != 0 => buffer[from],
                (Op::Activation(_) | Op::Softmax | Op::LogSoftmax, Some(&from)) => {
                    let alone = readers[from] == 1 && buffer[from] == from;
                    if alone && in_place(network, node, from) {
                        from
                    } else {
                        place
                    }
                }
                _ => place,
            };
            buffer.push(own);
        }
        Self {
            network,
            names,
            buffer,
        }
    }

    /// The nodes with a buffer of their own, the input aside.
    pub(super) fn buffers(&self) -> impl Iterator<Item = (usize, &Node)> {
        let own = |(place, _): &(usize, &Node)| *place > 0 && self.buffer[*place] == *place;
        self.network.nodes.iter().enumerate().filter(own)
    }

    /// The recurrent layers, with their places.
    pub(super) fn recurrent(&self) -> impl Iterator<Item = (usize, &crate::Recurrent)> {
        let layers = self.network.nodes.iter().enumerate();
        layers.filter_map(|(place, node)| match &node.op {
            Op::Recurrent(layer) => Some((place, layer)),
            _ => None,
        })
    }

    /// The vectors of the state: field and length.
    pub(super) fn state(&self) -> Vec<(String, usize)> {
        self.recurrent()
            .filter(|(_, layer)| layer.streaming)
            .flat_map(|(place, layer)| {
                let name = &self.names[place];
                let cell = format!("{name}_cell");
                [(name.clone(), layer.units), (cell, layer.units)]
                    .into_iter()
                    .take(layer.cell.vectors())
            })
            .collect()
    }

    /// Returns true if anything is kept from one call to the next.
    pub(super) fn is_stateful(&self) -> bool {
        self.network.state() > 0
    }

    /// The buffer of a node as an expression: `x` or `a.name`.
    pub(super) fn value(&self, node: usize) -> String {
        match self.buffer[node] {
            0 => "x".into(),
            own => format!("a.{}", self.names[own]),
        }
    }

    /// As [`Plan::value`], borrowed.
    pub(super) fn borrowed(&self, node: usize) -> String {
        match self.buffer[node] {
            0 => "x".into(),
            own => format!("&a.{}", self.names[own]),
        }
    }

    /// Number of layers that read a node.
    pub(super) fn readers(&self, node: usize) -> usize {
        let read = self.network.nodes.iter().flat_map(|node| &node.from);
        read.filter(|&&from| from == node).count()
    }

    /// Returns true if one layer alone reads the last values of a node's buffer.
    pub(super) fn is_read_once(&self, node: usize) -> bool {
        let buffer = self.buffer[node];
        let nodes = self.network.nodes.iter().enumerate();
        let outside = nodes.filter(|(place, _)| self.buffer[*place] != buffer);
        let read = outside.flat_map(|(_, node)| &node.from);
        read.filter(|&&from| self.buffer[from] == buffer).count() == 1
    }

    /// Returns true if the slopes of a node meet the adjoints in the layer that reads it: an
    /// activation, in place, that one layer reads.
    pub(super) fn fused(&self, node: usize) -> bool {
        matches!(self.network.nodes[node].op, Op::Activation(_))
            && self.is_in_place(node)
            && self.readers(node) == 1
    }

    /// Returns true if a node works in the buffer of its input.
    pub(super) fn is_in_place(&self, node: usize) -> bool {
        self.buffer[node] != node
    }
}

/// Returns true if an activation may overwrite its input: neither its own derivative nor that of
/// the layer before needs the value from before.
fn in_place(network: &Network, node: &Node, from: usize) -> bool {
    let before = !matches!(
        network.nodes[from].op,
        Op::Input | Op::Activation(_) | Op::Softmax | Op::LogSoftmax | Op::Normalise { .. }
    );
    let own = match node.op {
        Op::Activation(g) => g.slope_from_value(),
        _ => true,
    };
    before && own
}
