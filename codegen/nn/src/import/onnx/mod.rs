//! ONNX. Its images have channels first and ours last: values are turned where a layer asks for it,
//! and the turns before dense layers go into their weights.

mod arithmetic;
mod arrangement;
mod axes;
mod constant;
mod constant_arithmetic;
mod constants;
mod dense;
mod elementwise;
mod joined;
mod node;
mod normalisation;
mod operators;
mod padding;
mod proto;
mod recurrent;
mod reductions;
mod scikit_learn;
#[cfg(test)]
mod table;
#[cfg(test)]
mod tests;
mod values;
mod windows;

use std::collections::{HashMap, HashSet};

use prost::Message;

use crate::limits::{MAX_LENGTH, MAX_NODES, MAX_PARAMETERS};
use crate::{Activation, Network, NetworkError, Op};
use constant::{Constant, DOUBLE, FLOAT, type_name};
use node::Node;
use proto::{GraphProto, ModelProto};

/// Graph nodes that are looked at; several can make one layer.
const MAX_GRAPH: usize = 8 * MAX_NODES;
/// Values of all constants that are computed.
const MAX_COMPUTED: usize = 4 * MAX_PARAMETERS;
/// Versions of ONNX's operators whose meaning is known here.
const OPSETS: std::ops::RangeInclusive<i64> = 7..=26;

/// Meaning of a name in the graph.
#[derive(Clone, Debug)]
struct Value {
    /// The node that holds it.
    place: usize,
    /// Its shape as ONNX has it, without the batch.
    shape: Vec<usize>,
    /// Axis of the batch in ONNX's shape, an axis of length 1; none where no axis is 1.
    batch: Option<usize>,
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
    /// Names of values that say where a node is positive, or where it is not.
    signs: HashMap<&'a str, (Value, bool)>,
    /// Names of values that say where a node is so large that a softplus is a line.
    large: HashMap<&'a str, usize>,
    /// A call is one step of a sequence.
    streaming: bool,
    /// True if something reads what a recurrent layer gives after every step.
    reads_steps: bool,
    /// Names that a node reads, or that are the output.
    read: HashSet<&'a str>,
    /// Version of the operators.
    opset: i64,
    /// Values of all constants that were computed.
    computed: usize,
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
    let opset = opset(&model)?;
    if !graph.sparse_initializer.is_empty() {
        return Err(NetworkError::unsupported(
            "graph",
            "a sparse tensor of weights",
            "store weights densely",
        ));
    }
    let mut constants = HashMap::new();
    for tensor in &graph.initializer {
        constants.insert(tensor.name.as_str(), Constant::new(tensor)?);
    }
    let mut import = Import::new(name, graph, constants)?;
    import.opset = opset;
    import.nodes(graph)?;
    let [output] = graph.output.as_slice() else {
        return Err(NetworkError::unsupported(
            "graph",
            format!("{} outputs", graph.output.len()),
            "concatenate the outputs into one",
        ));
    };
    let of = (graph.node.iter()).find(|node| node.output.contains(&output.name));
    if let (true, Some(node)) = (import.constants.contains_key(output.name.as_str()), of) {
        return Err(NetworkError::unsupported(
            &output.name,
            format!("an output of {} alone, which is constant,", node.op_type),
            "compute the output from the input",
        ));
    }
    let result = import
        .values
        .get(output.name.as_str())
        .cloned()
        .ok_or_else(|| NetworkError::malformed(&output.name, "the output is given by no node"))?;
    import.finish(&output.name, &result)
}

/// The version of ONNX's own operators.
///
/// # Errors
/// One whose operators are not known here.
fn opset(model: &ModelProto) -> Result<i64, NetworkError> {
    let own = |domain: &str| ["", "ai.onnx"].contains(&domain);
    let found = model.opset_import.iter().find(|set| own(&set.domain));
    let version = found.map_or(1, |set| set.version);
    if OPSETS.contains(&version) {
        return Ok(version);
    }
    Err(NetworkError::unsupported(
        "model",
        format!("opset {version}"),
        format!("opsets {} to {} work", OPSETS.start(), OPSETS.end()),
    ))
}

fn is_recurrent(op: &str) -> bool {
    ["RNN", "GRU", "LSTM"].contains(&op)
}

/// Shape of the input, its batch and open axes taken out.
struct Opened {
    /// Axis of the batch.
    batch: Option<usize>,
    shape: Vec<usize>,
    /// The steps are open: one a call.
    streaming: bool,
}

impl Opened {
    fn new(graph: &GraphProto, input: &str, dims: &[Option<usize>]) -> Result<Self, NetworkError> {
        let recurrent = graph.node.iter().any(|node| is_recurrent(&node.op_type));
        // A recurrent layer reads steps first, the batch after.
        let steps_first = graph.node.iter().any(|node| {
            is_recurrent(&node.op_type) && node.input.first().is_some_and(|read| read == input)
        });
        let single = |axis: usize| dims.get(axis).is_some_and(|dim| dim.is_none_or(|n| n == 1));
        let batch = match (dims, steps_first) {
            // One row without a batch.
            (&[Some(n)], _) if n != 1 => None,
            (_, true) => Some(1),
            (&[Some(_), second, _], false)
                if recurrent && !single(0) && second.is_none_or(|n| n == 1) =>
            {
                Some(1)
            }
            _ => Some(0),
        };
        if batch.is_some_and(|batch| !single(batch)) {
            let shape: Vec<String> = dims
                .iter()
                .map(|dim| dim.map_or_else(|| "open".into(), |n| n.to_string()))
                .collect();
            let axis = batch.unwrap_or(0);
            let message = format!("an input of shape [{}]", shape.join(", "));
            return Err(NetworkError::unsupported(
                input,
                message,
                format!("a batch of 1 or an open one at axis {axis} works"),
            ));
        }
        let mut shape = Vec::new();
        let mut streaming = false;
        for (axis, dim) in dims
            .iter()
            .enumerate()
            .filter(|(axis, _)| Some(*axis) != batch)
        {
            let open_steps =
                recurrent && dims.len() == 3 && Some(axis) == batch.map(|batch| 1 - batch.min(1));
            if dim.is_none() && !open_steps {
                return Err(NetworkError::unsupported(
                    input,
                    format!("the open axis {axis}"),
                    "only the batch and the steps of a recurrent layer may be open",
                ));
            }
            streaming |= dim.is_none();
            shape.push(dim.unwrap_or(1));
        }
        Ok(Self {
            batch,
            shape,
            streaming,
        })
    }
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
        let tensor = input
            .kind
            .as_ref()
            .and_then(|kind| kind.tensor_type.as_ref());
        let kind = tensor.map_or(FLOAT, |tensor| tensor.elem_type);
        if ![0, FLOAT, DOUBLE].contains(&kind) {
            return Err(NetworkError::unsupported(
                &input.name,
                format!("an input of {}", type_name(kind)),
                "export in float32",
            ));
        }
        let dims = tensor
            .and_then(|tensor| tensor.shape.as_ref())
            .map_or(&[][..], |shape| &shape.dim);
        let dims: Vec<Option<usize>> = dims
            .iter()
            .map(|dim| dim.dim_value.filter(|&n| n > 0))
            .map(|n| n.map(|n| usize::try_from(n).unwrap_or(usize::MAX).min(MAX_LENGTH + 1)))
            .collect();
        let Opened {
            batch,
            shape,
            streaming,
        } = Opened::new(graph, &input.name, &dims)?;
        let network = Network::new(name, &input.name, shape.clone());
        let value = Value {
            place: 0,
            shape,
            batch,
            last: false,
            gelu: None,
        };
        let read: HashSet<&str> = (graph.node.iter().flat_map(|node| &node.input))
            .chain(graph.output.iter().map(|output| &output.name))
            .map(String::as_str)
            .filter(|name| !name.is_empty())
            .collect();
        let reads_steps = (graph.node.iter().filter(|node| is_recurrent(&node.op_type)))
            .filter_map(|node| node.output.first())
            .any(|name| read.contains(name.as_str()));
        Ok(Self {
            network,
            values: HashMap::from([(input.name.as_str(), value)]),
            constants,
            signs: HashMap::new(),
            large: HashMap::new(),
            streaming,
            reads_steps,
            read,
            opset: *OPSETS.end(),
            computed: 0,
        })
    }

    /// Adds every node; each has to follow what it reads, as ONNX demands.
    fn nodes(&mut self, graph: &'a GraphProto) -> Result<(), NetworkError> {
        for (place, proto) in graph.node.iter().enumerate() {
            let node: Node<'a> = Node::new(proto, place, self.opset);
            let machine_learning = proto.domain == "ai.onnx.ml";
            if !machine_learning && !["", "ai.onnx"].contains(&proto.domain.as_str()) {
                return Err(node.unsupported(
                    format!("{} of {}", proto.op_type, proto.domain),
                    "export with ONNX's own operators",
                ));
            }
            if machine_learning {
                let value = self.of_scikit_learn(&node)?;
                node.expect_read()?;
                if let Some(name) = proto.output.first() {
                    self.values.insert(name, value);
                }
                continue;
            }
            if let Some(constant) = self.constant_of(&node)? {
                node.expect_read()?;
                self.computed += constant.len();
                if self.computed > MAX_COMPUTED {
                    let message = format!("its constants are more than {MAX_COMPUTED} values");
                    return Err(NetworkError::too_large(node.name, message));
                }
                if let Some(output) = proto.output.first().filter(|name| !name.is_empty()) {
                    self.constants.insert(output, constant);
                }
                continue;
            }
            if self.sign(&node)? {
                node.expect_read()?;
                continue;
            }
            let outputs = self.node(&node)?;
            node.expect_read()?;
            let left = proto.output.iter().skip(outputs.len());
            if let Some(name) = left
                .into_iter()
                .find(|name| self.read.contains(name.as_str()))
            {
                let what = format!("output {name:?} of {}", proto.op_type);
                return Err(node.unsupported(what, "read only its first outputs"));
            }
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
        let value = self.any_value(node, input)?;
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
        let Some(name) = node.input(input) else {
            return Ok(None);
        };
        match self.constants.get(name) {
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

    /// Integers at an input of a node, or in an attribute of old versions; none where the input is
    /// computed.
    fn integers(&self, node: &Node<'_>, input: usize, attribute: &str) -> Option<Vec<i64>> {
        match node.input(input).map(|name| self.constants.get(name)) {
            Some(Some(Constant::Integers(list))) => Some(list.values.clone()),
            Some(_) => None,
            None => node.ints(attribute).map(<[i64]>::to_vec),
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
        self.last_steps();
        if result.last && result.shape.len() > 1 {
            let axes = result.shape.len();
            let order = [axes - 1].into_iter().chain(0..axes - 1).collect();
            place = self
                .network
                .push("output order", Op::Permute(order), vec![place])?;
        }
        if place == 0 {
            // A network has a layer besides its input.
            let name = self.free_name(name);
            let op = Op::Activation(Activation::Linear);
            place = self.network.push(&name, op, vec![0])?;
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
