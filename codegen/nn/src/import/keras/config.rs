//! The configuration of a model: which layers there are, and which reads which.

use serde_json::Value;

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
    pub(super) output: String,
}

/// One layer.
pub(super) struct Layer<'a> {
    pub(super) name: String,
    pub(super) class: &'a str,
    pub(super) config: &'a Value,
    pub(super) from: Vec<String>,
    /// Number of layers of this class before it: Keras 3 names weights by it.
    pub(super) number: usize,
}

fn wrong(message: &str) -> NetworkError {
    NetworkError::malformed("model configuration", message)
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
        let sequential = match class {
            "Sequential" => true,
            "Functional" | "Model" => false,
            other => {
                return Err(NetworkError::unsupported(
                    other,
                    "a model that is code of its own",
                    "build it as a Sequential or Functional model",
                ));
            }
        };
        let mut model = Self {
            input: String::new(),
            shape: Vec::new(),
            steps_open: false,
            layers: Vec::new(),
            output: String::new(),
        };
        let mut numbers = std::collections::HashMap::new();
        for value in list {
            let class = value["class_name"].as_str().unwrap_or("");
            let config = &value["config"];
            let name = value["name"]
                .as_str()
                .or(config["name"].as_str())
                .unwrap_or(class)
                .to_owned();
            if class == "InputLayer" {
                if !model.input.is_empty() {
                    return Err(NetworkError::unsupported(
                        name,
                        "a second input",
                        "concatenate the inputs into one",
                    ));
                }
                model.set_input(&name, &config["batch_shape"], &config["batch_input_shape"])?;
                continue;
            }
            if model.input.is_empty() && sequential {
                // Keras 2 keeps the input's shape in the first layer, Keras 3 in the model.
                let given = &config["batch_input_shape"];
                model.set_input("input", given, &root["config"]["build_input_shape"])?;
            }
            let number = numbers.entry(class).or_insert(0);
            let from = if sequential {
                vec![
                    model
                        .layers
                        .last()
                        .map_or(&model.input, |layer: &Layer<'_>| &layer.name)
                        .clone(),
                ]
            } else {
                sources(&name, &value["inbound_nodes"])?
            };
            model.layers.push(Layer {
                name,
                class,
                config,
                from,
                number: *number,
            });
            *number += 1;
        }
        model.output = if sequential {
            model
                .layers
                .last()
                .map(|layer| layer.name.clone())
                .unwrap_or_default()
        } else {
            single_output(&config["output_layers"])?
        };
        if model.input.is_empty() || model.layers.is_empty() {
            return Err(wrong("it has no input, or no layer after it"));
        }
        Ok(model)
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

/// The layers that a layer reads.
fn sources(layer: &str, nodes: &Value) -> Result<Vec<String>, NetworkError> {
    let nodes = nodes.as_array().map_or(&[][..], Vec::as_slice);
    let [node] = nodes else {
        return Err(NetworkError::unsupported(
            layer,
            format!("a layer that is used {} times", nodes.len()),
            "give each use a layer of its own".to_owned(),
        ));
    };
    let mut found = Vec::new();
    // Keras 3: {"args": [...]} with tensors anywhere within. Keras 2: a list of [name, node, tensor, ...].
    if node.is_object() {
        histories(&node["args"], 0, &mut found);
        histories(&node["kwargs"], 0, &mut found);
    } else if let Some(list) = node.as_array() {
        let listed = |value: &Value| value.as_array()?.first()?.as_str().map(String::from);
        found = list.iter().filter_map(listed).collect();
    }
    if found.is_empty() {
        return Err(NetworkError::malformed(layer, "it reads nothing"));
    }
    Ok(found)
}

fn histories(value: &Value, depth: usize, found: &mut Vec<String>) {
    if depth > 16 {
        return;
    }
    match value {
        Value::Object(map) => {
            let history = map.get("config").map(|config| &config["keras_history"][0]);
            if let Some(name) = history.and_then(Value::as_str) {
                found.push(name.into());
            } else {
                map.values()
                    .for_each(|value| histories(value, depth + 1, found));
            }
        }
        Value::Array(list) => list
            .iter()
            .for_each(|value| histories(value, depth + 1, found)),
        _ => {}
    }
}

/// `["name", 0, 0]`, or a list with one of these.
fn single_output(layers: &Value) -> Result<String, NetworkError> {
    let list = layers.as_array().map_or(&[][..], Vec::as_slice);
    match list {
        [Value::String(name), ..] => Ok(name.clone()),
        [one] => one[0]
            .as_str()
            .map(String::from)
            .ok_or_else(|| wrong("the output has no name")),
        _ => Err(NetworkError::unsupported(
            "model",
            format!("{} outputs", list.len()),
            "concatenate the outputs into one".to_owned(),
        )),
    }
}
