//! The configuration of a model: which layers there are, and which reads which.

use serde_json::Value;

use super::idle::IDLE;
use super::settings::{Settings, expect_float};
use crate::NetworkError;
use crate::limits::{MAX_LENGTH, MAX_NODES};

/// A model.
pub(super) struct Model<'a> {
    pub(super) input: String,
    /// Shape of the input, the batch aside; an open number of steps is 1.
    pub(super) shape: Vec<usize>,
    /// True if the number of steps is open: then a call is one step.
    pub(super) steps_open: bool,
    pub(super) layers: Vec<Layer<'a>>,
    pub(super) output: Source,
}

/// One layer.
pub(super) struct Layer<'a> {
    pub(super) name: String,
    pub(super) class: &'a str,
    pub(super) config: Settings<'a>,
    pub(super) from: Vec<Source>,
    /// Operands of an operation in order, constants among them; empty for a layer.
    pub(super) operands: Vec<Operand>,
    /// Indices and slices of a GetItem.
    pub(super) key: &'a Value,
    /// The wrapped layer whose weights these are: `forward` or `backward`; empty otherwise.
    pub(super) side: &'static str,
    /// Number of layers of this class before it: Keras 3 names weights by it.
    pub(super) number: usize,
}

/// One output of a layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    /// Name of the layer.
    pub(super) layer: String,
    /// Number of the output.
    pub(super) output: usize,
}

/// An operand of an operation.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Operand {
    /// An output of a layer.
    Layer(Source),
    /// A constant: its shape and its values.
    Constant(Vec<usize>, Vec<f32>),
}

/// The module of Keras 3's operations.
const OPERATIONS: &str = "keras.src.ops";

fn wrong(message: &str) -> NetworkError {
    NetworkError::malformed("model configuration", message)
}

/// Returns true for a list of layers, false for a graph.
///
/// # Errors
/// A model that is neither.
fn is_sequential(class: &str) -> Result<bool, NetworkError> {
    match class {
        "Sequential" => Ok(true),
        "Functional" | "Model" => Ok(false),
        other => Err(NetworkError::unsupported(
            other,
            "a model that is code of its own",
            "build it as a Sequential or Functional model",
        )),
    }
}

fn name_of<'a>(class: &'a str, value: &'a Value) -> &'a str {
    let stated = value["name"].as_str().or(value["config"]["name"].as_str());
    stated.unwrap_or(class)
}

/// Returns true for an operation of Keras 3, which is no layer.
fn is_operation(class: &str, value: &Value) -> bool {
    // Files of the older format do not say where a class is from; a layer can be trained.
    match value["module"].as_str() {
        Some(module) => module.starts_with(OPERATIONS),
        None => {
            let bare = value["config"]["trainable"].is_null() && !IDLE.contains(&class);
            bare && value["inbound_nodes"][0].is_object()
        }
    }
}

impl<'a> Model<'a> {
    /// # Errors
    /// The configuration is not that of a model of one input and one output.
    pub(super) fn new(root: &'a Value) -> Result<Self, NetworkError> {
        let class = root["class_name"].as_str().unwrap_or("");
        let config = &root["config"];
        let list = config["layers"]
            .as_array()
            .ok_or_else(|| wrong("there are no layers"))?;
        if list.len() > MAX_NODES {
            return Err(wrong(&format!("more than {MAX_NODES} layers")));
        }
        let sequential = is_sequential(class)?;
        let mut model = Self {
            input: String::new(),
            shape: Vec::new(),
            steps_open: false,
            layers: Vec::new(),
            output: Source::of(""),
        };
        let mut numbers = std::collections::HashMap::new();
        for value in list {
            let class = value["class_name"].as_str().unwrap_or("");
            let config = &value["config"];
            let name = name_of(class, value).to_owned();
            expect_own(&name, class, value)?;
            expect_float(&name, &config["dtype"])?;
            if class == "InputLayer" {
                model.expect_one_dense_input(&name, config)?;
                model.set_input(&name, &config["batch_shape"], &config["batch_input_shape"])?;
                continue;
            }
            if model.input.is_empty() && sequential {
                // Keras 2 keeps the input's shape in the first layer, Keras 3 in the model.
                let given = &config["batch_input_shape"];
                model.set_input("input", given, &root["config"]["build_input_shape"])?;
            }
            let number = numbers.entry(class).or_insert(0);
            let mut operands = Vec::new();
            let from = if sequential {
                let last: Option<&Layer<'_>> = model.layers.last();
                vec![Source::of(last.map_or(&model.input, |layer| &layer.name))]
            } else {
                operands = sources(&name, class, &value["inbound_nodes"])?;
                operands
                    .iter()
                    .filter_map(Operand::layer)
                    .cloned()
                    .collect()
            };
            let operation = is_operation(class, value);
            let constant = operands.iter().any(|operand| operand.layer().is_none());
            if !operation && constant {
                return Err(NetworkError::unsupported(
                    name,
                    format!("{class} of a constant"),
                    "call the layer with tensors only",
                ));
            }
            if !operation {
                operands.clear();
            }
            model.layers.push(Layer {
                name,
                class,
                config: Settings::new(config),
                from,
                operands,
                key: &value["inbound_nodes"][0]["args"][1],
                side: "",
                number: *number,
            });
            *number += 1;
        }
        model.output = if sequential {
            Source::of(model.layers.last().map_or("", |layer| &layer.name))
        } else {
            single_output(&config["output_layers"])?
        };
        if model.input.is_empty() || model.layers.is_empty() {
            return Err(wrong("it has no input, or no layer after it"));
        }
        Ok(model)
    }

    /// Refuses an input that is not dense, and a second one.
    fn expect_one_dense_input(&self, name: &str, config: &'a Value) -> Result<(), NetworkError> {
        let settings = Settings::new(config);
        for key in ["sparse", "ragged", "optional"] {
            if settings[key].as_bool() == Some(true) {
                return Err(NetworkError::unsupported(
                    name,
                    format!("an input with {key}=True"),
                    "use a dense input",
                ));
            }
        }
        settings.expect_read(name, "InputLayer")?;
        if !self.input.is_empty() {
            return Err(NetworkError::unsupported(
                name,
                "a second input",
                "concatenate the inputs into one",
            ));
        }
        Ok(())
    }

    fn set_input(&mut self, name: &str, first: &Value, second: &Value) -> Result<(), NetworkError> {
        let shape = first.as_array().or(second.as_array()).ok_or_else(|| {
            NetworkError::malformed(
                name,
                "the shape of the input is not there: build the model before saving",
            )
        })?;
        self.input = name.into();
        for (axis, length) in shape.iter().enumerate().skip(1) {
            let length = match length.as_u64() {
                Some(length) => usize::try_from(length)
                    .unwrap_or(usize::MAX)
                    .min(MAX_LENGTH + 1),
                None if axis == 1 && shape.len() == 3 => {
                    self.steps_open = true;
                    1
                }
                None => {
                    return Err(NetworkError::unsupported(
                        name,
                        format!("an input of shape {shape:?}"),
                        "only the number of steps of a sequence may be open".to_owned(),
                    ));
                }
            };
            self.shape.push(length);
        }
        Ok(())
    }
}

impl Source {
    /// The first output of a layer.
    fn of(layer: &str) -> Self {
        Self {
            layer: layer.into(),
            output: 0,
        }
    }

    /// An output of a layer by its number in the configuration.
    fn numbered(layer: &str, number: &Value) -> Self {
        Self {
            layer: layer.into(),
            output: number
                .as_u64()
                .map_or(0, |number| usize::try_from(number).unwrap_or(usize::MAX)),
        }
    }
}

impl Operand {
    /// The output of a layer, if it is one.
    fn layer(&self) -> Option<&Source> {
        match self {
            Self::Layer(source) => Some(source),
            Self::Constant(..) => None,
        }
    }
}

/// That a layer, or a cell or a layer within one, is Keras's own.
///
/// # Errors
/// It is code of somebody's own.
pub(super) fn expect_own(name: &str, class: &str, value: &Value) -> Result<(), NetworkError> {
    let module = &value["module"];
    let own = match module.as_str() {
        Some(module) => ["keras", "tf_keras", "tensorflow.keras"].iter().any(|own| {
            module
                .strip_prefix(own)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        }),
        // Keras 2 names neither. Keras 3 names a class of one's own that has no module, be it
        // called like one of Keras's.
        None => value["registered_name"].is_null(),
    };
    if own {
        return Ok(());
    }
    Err(NetworkError::unsupported(
        name,
        format!("the layer {class}, which is code of its own,"),
        "build it of Keras's layers",
    ))
}

/// The operands of a layer or operation: tensors, and constants between them.
fn sources(layer: &str, class: &str, nodes: &Value) -> Result<Vec<Operand>, NetworkError> {
    let nodes = nodes.as_array().map_or(&[][..], Vec::as_slice);
    let [node] = nodes else {
        return Err(NetworkError::unsupported(
            layer,
            format!("a layer that is used {} times", nodes.len()),
            "give each use a layer of its own".to_owned(),
        ));
    };
    let mut found = Vec::new();
    // Keras 3: {"args": [...]} with tensors anywhere within. Keras 2: a list of [name, node,
    // tensor, kwargs].
    if node.is_object() {
        // The indices of a GetItem are no operands.
        let args = &node["args"];
        let args = if class == "GetItem" { &args[0] } else { args };
        operands(layer, args, 0, &mut found)?;
        let named = node["kwargs"].as_object();
        for (key, value) in named.into_iter().flatten() {
            if is_idle(key, value) {
                continue;
            }
            // A recurrent layer starts at zero anyway.
            if key == "initial_state" && is_zero(layer, value)? {
                continue;
            }
            // The operands of an operation can be named.
            if !["x", "x1", "x2", "inputs", "sequence"].contains(&key.as_str()) {
                return Err(argument(layer, class, key));
            }
            operands(layer, value, 0, &mut found)?;
        }
    } else if let Some(list) = node.as_array() {
        for entry in list {
            let name = entry[0]
                .as_str()
                .ok_or_else(|| argument(layer, class, "of this kind"))?;
            found.push(Operand::Layer(Source::numbered(name, &entry[2])));
            let named = entry[3].as_object();
            if let Some((key, _)) = named
                .into_iter()
                .flatten()
                .find(|(key, value)| !is_idle(key, value))
            {
                return Err(argument(layer, class, key));
            }
        }
    }
    let tensors = found
        .iter()
        .filter(|operand| operand.layer().is_some())
        .count();
    if tensors == 0 {
        return Err(NetworkError::malformed(layer, "it reads nothing"));
    }
    if ["SimpleRNN", "GRU", "LSTM", "RNN"].contains(&class) && found.len() > 1 {
        return Err(argument(layer, class, "initial_state"));
    }
    Ok(found)
}

/// True if an argument is nothing but constants of zero.
fn is_zero(layer: &str, value: &Value) -> Result<bool, NetworkError> {
    let mut found = Vec::new();
    operands(layer, value, 0, &mut found)?;
    let zero = |operand: &Operand| match operand {
        Operand::Layer(_) => false,
        Operand::Constant(_, values) => values.iter().all(|&value| value == 0.0),
    };
    Ok(found.iter().all(zero))
}

/// Arguments of a call that change nothing in a trained network.
fn is_idle(key: &str, value: &Value) -> bool {
    value.is_null() || (key == "training" && value.as_bool() == Some(false))
}

fn argument(layer: &str, class: &str, key: &str) -> NetworkError {
    let (what, nearest) = match key {
        "initial_state" => (
            format!("a first state that is computed, initial_state of {class},"),
            "start from zero, and give the network what the state was computed from".to_owned(),
        ),
        "mask" => (
            format!("a mask of {class}"),
            "use sequences of equal length".to_owned(),
        ),
        key => (
            format!("the argument {key} of {class}"),
            "call the layer with its inputs alone".to_owned(),
        ),
    };
    NetworkError::unsupported(layer, what, nearest)
}

fn operands(
    layer: &str,
    value: &Value,
    depth: usize,
    found: &mut Vec<Operand>,
) -> Result<(), NetworkError> {
    if depth > 16 {
        return Err(NetworkError::malformed(
            layer,
            "its inputs are lists within lists without end",
        ));
    }
    if let Some(number) = value.as_f64() {
        found.push(Operand::Constant(Vec::new(), vec![number as f32]));
        return Ok(());
    }
    match value {
        Value::Object(map) => {
            let config = map.get("config").unwrap_or(&Value::Null);
            if let Some(name) = config["keras_history"][0].as_str() {
                let source = Source::numbered(name, &config["keras_history"][2]);
                found.push(Operand::Layer(source));
                return Ok(());
            }
            let class = map.get("class_name").and_then(Value::as_str).unwrap_or("");
            if ["__numpy__", "__tensor__"].contains(&class) {
                let (shape, values) = array(layer, &config["value"], 0)?;
                found.push(Operand::Constant(shape, values));
                return Ok(());
            }
            Err(argument(layer, "the layer", &format!("{class:?}")))
        }
        Value::Array(list) => list
            .iter()
            .try_for_each(|value| operands(layer, value, depth + 1, found)),
        Value::Null => Ok(()),
        other => Err(argument(layer, "the layer", &other.to_string())),
    }
}

/// Lists of numbers: their shape and the numbers.
fn array(layer: &str, value: &Value, depth: usize) -> Result<(Vec<usize>, Vec<f32>), NetworkError> {
    let wrong = || NetworkError::malformed(layer, "a constant that is no array of numbers");
    let Value::Array(list) = value else {
        let number = value.as_f64().ok_or_else(wrong)?;
        return Ok((Vec::new(), vec![number as f32]));
    };
    if depth > 16 {
        return Err(wrong());
    }
    let mut values = Vec::new();
    let mut inner = None;
    for value in list {
        let (shape, part) = array(layer, value, depth + 1)?;
        if inner.get_or_insert_with(|| shape.clone()) != &shape {
            return Err(wrong());
        }
        values.extend(part);
    }
    let shape = [vec![list.len()], inner.unwrap_or_default()].concat();
    Ok((shape, values))
}

/// `["name", 0, 0]`, or a list with one of these: layer, call and output.
fn single_output(layers: &Value) -> Result<Source, NetworkError> {
    let list = layers.as_array().map_or(&[][..], Vec::as_slice);
    match list {
        [Value::String(name), _, output] => Ok(Source::numbered(name, output)),
        [one] => one[0]
            .as_str()
            .map(|name| Source::numbered(name, &one[2]))
            .ok_or_else(|| wrong("the output has no name")),
        _ => Err(NetworkError::unsupported(
            "model",
            format!("{} outputs", list.len()),
            "concatenate the outputs into one".to_owned(),
        )),
    }
}
