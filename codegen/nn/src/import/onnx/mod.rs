//! ONNX. Its images have channels first and ours last: values are turned where a layer asks for it, and the
//! turns before dense layers go into their weights.

mod arithmetic;
mod constant;
mod layers;
mod node;
mod proto;
mod recurrent;

use std::collections::{HashMap, HashSet};

use prost::Message;

use crate::limits::{MAX_LENGTH, MAX_NODES};
use crate::{Activation, Network, NetworkError, Op};
use constant::Constant;
use node::Node;
use proto::{GraphProto, ModelProto};

/// Graph nodes that are looked at; several can make one layer.
const MAX_GRAPH: usize = 8 * MAX_NODES;

/// Meaning of a name in the graph.
#[derive(Clone, Debug)]
struct Value {
    /// The node that holds it.
    place: usize,
    /// Its shape as ONNX has it, without the batch.
    shape: Vec<usize>,
    /// Axis of the batch in ONNX's shape.
    batch: usize,
    /// True if the node holds it with ONNX's first axis last.
    last: bool,
    /// On the way to becoming a GELU.
    gelu: Option<Gelu>,
}

/// Steps of `x Phi(x)` written out; `of` is x.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gelu {
    of: usize,
    /// `1 +` has been added to the error function.
    plus_one: bool,
    /// `x` has been multiplied in.
    times_x: bool,
    /// One half has been multiplied in.
    half: bool,
}

struct Import<'a> {
    network: Network,
    values: HashMap<&'a str, Value>,
    constants: HashMap<&'a str, Constant>,
    /// A call is one step of a sequence.
    streaming: bool,
    /// Names that a node reads, or that are the output.
    read: HashSet<&'a str>,
}

/// # Errors
/// [`NetworkError`].
pub(super) fn import(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    let model = ModelProto::decode(bytes).map_err(|error| {
        NetworkError::malformed(
            "ONNX",
            format!("no whole ONNX file, perhaps cut off: {error}"),
        )
    })?;
    let graph = model
        .graph
        .as_ref()
        .ok_or_else(|| NetworkError::malformed("ONNX", "no graph"))?;
    if graph.node.len() > MAX_GRAPH {
        let message = format!("{} nodes: at most {MAX_GRAPH}", graph.node.len());
        return Err(NetworkError::too_large("graph", message));
    }
    let mut constants = HashMap::new();
    for tensor in &graph.initializer {
        constants.insert(tensor.name.as_str(), Constant::new(tensor)?);
    }
    let mut import = Import::new(name, graph, constants)?;
    import.nodes(graph)?;
    let [output] = graph.output.as_slice() else {
        return Err(NetworkError::unsupported(
            "graph",
            format!("{} outputs", graph.output.len()),
            "concatenate the outputs into one",
        ));
    };
    let result = import
        .values
        .get(output.name.as_str())
        .cloned()
        .ok_or_else(|| NetworkError::malformed(&output.name, "the output is given by no node"))?;
    import.finish(&output.name, &result)
}

impl<'a> Import<'a> {
    fn new(
        name: &str,
        graph: &'a GraphProto,
        constants: HashMap<&'a str, Constant>,
    ) -> Result<Self, NetworkError> {
        // Old files list weights among the inputs too.
        let inputs: Vec<_> = graph
            .input
            .iter()
            .filter(|input| !constants.contains_key(input.name.as_str()))
            .collect();
        let [input] = inputs.as_slice() else {
            return Err(NetworkError::unsupported(
                "graph",
                format!("{} inputs", inputs.len()),
                "concatenate the inputs into one; state that a graph is given starts at zero here",
            ));
        };
        let dims = input
            .kind
            .as_ref()
            .and_then(|kind| kind.tensor_type.as_ref());
        let dims = dims
            .and_then(|tensor| tensor.shape.as_ref())
            .map_or(&[][..], |shape| &shape.dim);
        let dims: Vec<Option<usize>> = dims
            .iter()
            .map(|dim| dim.dim_value.filter(|&n| n > 0))
            .map(|n| n.map(|n| usize::try_from(n).unwrap_or(usize::MAX).min(MAX_LENGTH + 1)))
            .collect();
        // A recurrent layer reads steps first, the batch after.
        let steps_first = graph.node.iter().any(|node| {
            ["RNN", "GRU", "LSTM"].contains(&node.op_type.as_str())
                && node.input.first() == Some(&input.name)
        });
        let batch = usize::from(steps_first);
        if dims
            .get(batch)
            .is_none_or(|dim| dim.is_some_and(|n| n != 1))
        {
            let message =
                format!("its shape is {dims:?}: expected a batch of 1 or open at axis {batch}");
            return Err(NetworkError::malformed(&input.name, message));
        }
        let mut shape = Vec::new();
        let mut streaming = false;
        for (axis, dim) in dims.iter().enumerate().filter(|(axis, _)| *axis != batch) {
            let recurrent = graph
                .node
                .iter()
                .any(|n| ["RNN", "GRU", "LSTM"].contains(&n.op_type.as_str()));
            let open_steps = recurrent && dims.len() == 3 && axis == 1 - batch;
            if dim.is_none() && !open_steps {
                return Err(NetworkError::unsupported(
                    &input.name,
                    format!("the open axis {axis}"),
                    "only the batch and the steps of a recurrent layer may be open",
                ));
            }
            streaming |= dim.is_none();
            shape.push(dim.unwrap_or(1));
        }
        let network = Network::new(name, &input.name, shape.clone());
        let value = Value {
            place: 0,
            shape,
            batch,
            last: false,
            gelu: None,
        };
        Ok(Self {
            network,
            values: HashMap::from([(input.name.as_str(), value)]),
            constants,
            streaming,
            read: (graph.node.iter().flat_map(|node| &node.input))
                .chain(graph.output.iter().map(|output| &output.name))
                .map(String::as_str)
                .collect(),
        })
    }

    /// Adds every node; each has to follow what it reads, as ONNX demands.
    fn nodes(&mut self, graph: &'a GraphProto) -> Result<(), NetworkError> {
        for (place, proto) in graph.node.iter().enumerate() {
            let node = Node::new(proto, place);
            if !["", "ai.onnx"].contains(&proto.domain.as_str()) {
                return Err(node.unsupported(
                    format!("{} of {}", proto.op_type, proto.domain),
                    "export with ONNX's own operators",
                ));
            }
            if proto.op_type == "Constant" {
                let tensor = node.tensor("value");
                let tensor = tensor
                    .ok_or_else(|| node.unsupported("a constant of this kind", "use a tensor"))?;
                let constant = Constant::new(tensor)?;
                if let Some(output) = proto.output.first() {
                    self.constants.insert(output, constant);
                }
                continue;
            }
            let outputs = self.node(&node)?;
            for (name, value) in proto.output.iter().zip(outputs) {
                if !name.is_empty() && self.values.insert(name, value).is_some() {
                    return Err(node.malformed(format!("{name:?} is given twice")));
                }
            }
        }
        Ok(())
    }

    /// The value at an input of a node.
    fn value(&self, node: &Node<'_>, input: usize) -> Result<Value, NetworkError> {
        let name = node.proto.input.get(input).map_or("", String::as_str);
        let value = self.values.get(name).cloned().ok_or_else(|| {
            node.malformed(format!("it reads {name:?}, which no node before it gives"))
        })?;
        if value.gelu.is_some() {
            return Err(node.unsupported(
                "an error function",
                "Erf works within GELU: x (1 + erf(x / sqrt 2)) / 2",
            ));
        }
        Ok(value)
    }

    /// The weights at an input of a node, if it has that input.
    fn weights(
        &self,
        node: &Node<'_>,
        input: usize,
    ) -> Result<Option<&super::tensor::Tensor>, NetworkError> {
        let Some(name) = node.proto.input.get(input).filter(|name| !name.is_empty()) else {
            return Ok(None);
        };
        match self.constants.get(name.as_str()) {
            Some(Constant::Floats(tensor)) => Ok(Some(tensor)),
            _ => Err(node.unsupported(
                format!("an input {name:?} that is no constant"),
                "store it as weights",
            )),
        }
    }

    /// As [`Import::weights`].
    fn needed(
        &self,
        node: &Node<'_>,
        input: usize,
    ) -> Result<&super::tensor::Tensor, NetworkError> {
        self.weights(node, input)?
            .ok_or_else(|| node.malformed(format!("input {input} is missing")))
    }

    /// Integers at an input of a node, or in an attribute of old versions.
    fn integers(&self, node: &Node<'_>, input: usize, attribute: &str) -> Option<Vec<i64>> {
        let name = node.proto.input.get(input).map_or("", String::as_str);
        match self.constants.get(name) {
            Some(Constant::Integers(values)) => Some(values.clone()),
            _ => node.ints(attribute).map(<[i64]>::to_vec),
        }
    }

    fn push(&mut self, node: &Node<'_>, op: Op, from: usize) -> Result<usize, NetworkError> {
        let name = self.free_name(&node.name);
        self.network.push(&name, op, vec![from])
    }

    /// The name, or the name with a number, that no layer has yet.
    fn free_name(&self, name: &str) -> String {
        let taken = |name: &str| self.network.nodes.iter().any(|node| node.name == name);
        let mut free = name.to_owned();
        let mut number = 2;
        while taken(&free) {
            free = format!("{name} {number}");
            number += 1;
        }
        free
    }

    /// The node's shape made that of the value, as it is held.
    fn shaped(&mut self, node: &Node<'_>, value: &Value) -> Result<usize, NetworkError> {
        let held = if value.last {
            rotated(&value.shape)
        } else {
            value.shape.clone()
        };
        if self.network.nodes[value.place].shape == held {
            return Ok(value.place);
        }
        self.push(node, Op::Reshape(held), value.place)
    }

    /// The value with ONNX's first axis last, as images are held here.
    fn channels_last(&mut self, node: &Node<'_>, value: Value) -> Result<Value, NetworkError> {
        let place = self.shaped(node, &value)?;
        let axes = value.shape.len();
        if value.last || axes < 2 {
            return Ok(Value { place, ..value });
        }
        let order = (1..axes).chain([0]).collect();
        let place = self.push(node, Op::Permute(order), place)?;
        Ok(Value {
            place,
            last: true,
            ..value
        })
    }

    /// The value with its axes in ONNX's order.
    fn as_written(&mut self, node: &Node<'_>, value: Value) -> Result<Value, NetworkError> {
        let place = self.shaped(node, &value)?;
        let axes = value.shape.len();
        if !value.last || axes < 2 {
            return Ok(Value {
                place,
                last: false,
                ..value
            });
        }
        let order = [axes - 1].into_iter().chain(0..axes - 1).collect();
        let place = self.push(node, Op::Permute(order), place)?;
        Ok(Value {
            place,
            last: false,
            ..value
        })
    }

    fn activation(&mut self, node: &Node<'_>, g: Activation) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let place = self.push(node, Op::Activation(g), value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    fn finish(mut self, name: &str, result: &Value) -> Result<Network, NetworkError> {
        if result.gelu.is_some() {
            return Err(NetworkError::unsupported(
                name,
                "an error function as output",
                "use tanh",
            ));
        }
        let mut place = result.place;
        if result.last && result.shape.len() > 1 {
            let axes = result.shape.len();
            let order = [axes - 1].into_iter().chain(0..axes - 1).collect();
            place = self
                .network
                .push("output order", Op::Permute(order), vec![place])?;
        }
        self.network.nodes.truncate(place + 1);
        self.network.drop_unread();
        Ok(self.network)
    }
}

/// A shape with its first axis last.
fn rotated(shape: &[usize]) -> Vec<usize> {
    match shape {
        [first, rest @ ..] if !rest.is_empty() => [rest, &[*first]].concat(),
        _ => shape.to_vec(),
    }
}
