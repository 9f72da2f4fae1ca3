//! A network on disk: a folder with `network.toml` (what a person reads, or writes) and
//! `weights.safetensors` (the numbers). docs/reference/networks.md describes both.

use std::collections::HashMap;
use std::path::Path;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use serde::{Deserialize, Serialize};

use super::limits::{MAX_FILE_BYTES, MAX_GOLDEN};
use super::{
    Activation, Cell, Convolution, Dense, Golden, Network, NetworkError, Op, Pool, PoolKind,
    Recurrent, Window,
};
use crate::files;

/// Format that `network.toml` names.
pub const FORMAT: &str = "sinew-network/1";
/// The description's file name.
pub const NETWORK_FILE: &str = "network.toml";
/// The weights' file name.
pub const WEIGHTS_FILE: &str = "weights.safetensors";
/// Larger than any description that the limits admit.
const MAX_TEXT_BYTES: u64 = 1024 * 1024;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    format: String,
    name: String,
    input: InputText,
    layer: Vec<LayerText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct InputText {
    name: String,
    shape: Vec<usize>,
}

/// A layer; it reads the one before it unless `from` names others.
#[derive(Serialize, Deserialize)]
struct LayerText {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    from: Option<Vec<String>>,
    #[serde(flatten)]
    kind: Kind,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Kind {
    Dense,
    Convolution {
        #[serde(flatten)]
        window: WindowText,
    },
    MaxPool {
        #[serde(flatten)]
        window: WindowText,
    },
    AveragePool {
        #[serde(flatten)]
        window: WindowText,
        #[serde(default)]
        count_padding: bool,
    },
    Reshape {
        shape: Vec<usize>,
    },
    Permute {
        axes: Vec<usize>,
    },
    Scale,
    Activation {
        #[serde(flatten)]
        function: Function,
    },
    Softmax,
    SimpleRnn {
        activation: Function,
        sequences: bool,
        streaming: bool,
    },
    Gru {
        activation: Function,
        gates: Function,
        reset_after: bool,
        sequences: bool,
        streaming: bool,
    },
    Lstm {
        activation: Function,
        gates: Function,
        sequences: bool,
        streaming: bool,
    },
    Add,
    Concatenate {
        axis: usize,
    },
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct WindowText {
    size: [usize; 2],
    #[serde(default = "ones")]
    stride: [usize; 2],
    #[serde(default = "ones")]
    dilation: [usize; 2],
    #[serde(default)]
    before: [usize; 2],
    #[serde(default)]
    after: [usize; 2],
}

fn ones() -> [usize; 2] {
    [1; 2]
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(tag = "function", rename_all = "snake_case")]
enum Function {
    Linear,
    Relu,
    LeakyRelu { alpha: f32 },
    Elu { alpha: f32, scale: f32 },
    Gelu,
    GeluTanh,
    Softplus,
    Softsign,
    Swish,
    HardSigmoid { alpha: f32, beta: f32 },
    Sigmoid,
    Tanh,
    Exponential,
}

macro_rules! same_names {
    ($value:expr, $from:ident => $to:ident) => {
        match $value {
            $from::Linear => $to::Linear,
            $from::Relu => $to::Relu,
            $from::LeakyRelu { alpha } => $to::LeakyRelu { alpha },
            $from::Elu { alpha, scale } => $to::Elu { alpha, scale },
            $from::Gelu => $to::Gelu,
            $from::GeluTanh => $to::GeluTanh,
            $from::Softplus => $to::Softplus,
            $from::Softsign => $to::Softsign,
            $from::Swish => $to::Swish,
            $from::HardSigmoid { alpha, beta } => $to::HardSigmoid { alpha, beta },
            $from::Sigmoid => $to::Sigmoid,
            $from::Tanh => $to::Tanh,
            $from::Exponential => $to::Exponential,
        }
    };
}

impl From<Function> for Activation {
    fn from(function: Function) -> Self {
        same_names!(function, Function => Activation)
    }
}

impl From<Activation> for Function {
    fn from(activation: Activation) -> Self {
        same_names!(activation, Activation => Function)
    }
}

impl From<WindowText> for Window {
    fn from(text: WindowText) -> Self {
        let WindowText {
            size,
            stride,
            dilation,
            before,
            after,
        } = text;
        Self {
            size,
            stride,
            dilation,
            before,
            after,
        }
    }
}

impl From<Window> for WindowText {
    fn from(window: Window) -> Self {
        let Window {
            size,
            stride,
            dilation,
            before,
            after,
        } = window;
        Self {
            size,
            stride,
            dilation,
            before,
            after,
        }
    }
}

/// Reads and validates the network in `directory`.
///
/// ```no_run
/// use sinew_nn::store;
///
/// let network = store::load("net".as_ref())?;
/// store::save("copy".as_ref(), &network)?;
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
///
/// # Errors
/// [`NetworkError`], naming the file and what is wrong in it.
pub fn load(directory: &Path) -> Result<Network, NetworkError> {
    let read = |file: &str, max: u64| {
        let path = directory.join(file);
        files::read(&path, max).map_err(|error| NetworkError::caused(file, error))
    };
    let text = String::from_utf8(read(NETWORK_FILE, MAX_TEXT_BYTES)?)
        .map_err(|_| NetworkError::malformed(NETWORK_FILE, "it is not UTF-8 text"))?;
    let weights = read(WEIGHTS_FILE, MAX_FILE_BYTES)?;
    parse(&text, &weights).map_err(|error| error.within(&directory.display().to_string()))
}

/// Reads and validates a network from the contents of its two files.
///
/// # Errors
/// [`NetworkError`].
pub fn parse(text: &str, weights: &[u8]) -> Result<Network, NetworkError> {
    let wrong = |message: String| NetworkError::malformed(NETWORK_FILE, message);
    let text: Text =
        toml::from_str(text).map_err(|error| NetworkError::caused(NETWORK_FILE, error))?;
    if text.format != FORMAT {
        return Err(wrong(format!(
            "the format is {:?}: this program reads {FORMAT:?}",
            text.format
        )));
    }
    let file = SafeTensors::deserialize(weights).map_err(|error| {
        NetworkError::malformed(
            WEIGHTS_FILE,
            format!("this is no safetensors file: {error}"),
        )
    })?;
    super::shape::check(&text.input.name, &text.input.shape)?;
    let mut network = Network::new(&text.name, &text.input.name, text.input.shape);
    let mut places = HashMap::from([(text.input.name, 0)]);
    for layer in text.layer {
        let before = network.nodes.len() - 1;
        let from = match &layer.from {
            None => vec![before],
            Some(names) => names
                .iter()
                .map(|name| {
                    places.get(name).copied().ok_or_else(|| {
                        let message = format!("it reads {name:?}, which is no layer before it");
                        NetworkError::malformed(&layer.name, message)
                    })
                })
                .collect::<Result<_, _>>()?,
        };
        let op = op(&layer.name, layer.kind, &file)?;
        let place = network.push(&layer.name, op, from)?;
        if places.insert(layer.name.clone(), place).is_some() {
            return Err(NetworkError::malformed(
                layer.name,
                "two layers have this name",
            ));
        }
    }
    network.golden = golden(&network, &file)?;
    network.validate()?;
    Ok(network)
}

fn op(layer: &str, kind: Kind, file: &SafeTensors<'_>) -> Result<Op, NetworkError> {
    let list = |name: &str| floats(file, &format!("{layer}.{name}"));
    let recurrent = |cell: Cell, sequences: bool, streaming: bool| -> Result<Op, NetworkError> {
        let recurrent = list("recurrent")?;
        let bias = list("bias")?;
        let reset_after = matches!(
            cell,
            Cell::Gru {
                reset_after: true,
                ..
            }
        );
        Ok(Op::Recurrent(Recurrent {
            cell,
            units: bias.len() / cell.gates(),
            kernel: list("kernel")?,
            recurrent,
            bias,
            inner_bias: if reset_after {
                list("inner_bias")?
            } else {
                Vec::new()
            },
            sequences,
            streaming,
        }))
    };
    Ok(match kind {
        Kind::Dense => Op::Dense(Dense {
            weights: list("weights")?,
            bias: list("bias")?,
        }),
        Kind::Convolution { window } => Op::Convolution(Convolution {
            window: window.into(),
            weights: list("weights")?,
            bias: list("bias")?,
        }),
        Kind::MaxPool { window } => Op::Pool(Pool {
            window: window.into(),
            kind: PoolKind::Max,
        }),
        Kind::AveragePool {
            window,
            count_padding,
        } => Op::Pool(Pool {
            window: window.into(),
            kind: if count_padding {
                PoolKind::AverageWithPadding
            } else {
                PoolKind::Average
            },
        }),
        Kind::Reshape { shape } => Op::Reshape(shape),
        Kind::Permute { axes } => Op::Permute(axes),
        Kind::Scale => Op::Scale {
            gain: list("gain")?,
            offset: list("offset")?,
        },
        Kind::Activation { function } => Op::Activation(function.into()),
        Kind::Softmax => Op::Softmax,
        Kind::SimpleRnn {
            activation,
            sequences,
            streaming,
        } => recurrent(
            Cell::Simple {
                activation: activation.into(),
            },
            sequences,
            streaming,
        )?,
        Kind::Gru {
            activation,
            gates,
            reset_after,
            sequences,
            streaming,
        } => {
            let cell = Cell::Gru {
                activation: activation.into(),
                gates: gates.into(),
                reset_after,
            };
            recurrent(cell, sequences, streaming)?
        }
        Kind::Lstm {
            activation,
            gates,
            sequences,
            streaming,
        } => {
            let cell = Cell::Lstm {
                activation: activation.into(),
                gates: gates.into(),
            };
            recurrent(cell, sequences, streaming)?
        }
        Kind::Add => Op::Add,
        Kind::Concatenate { axis } => Op::Concatenate(axis),
    })
}

fn kind(op: &Op) -> Option<Kind> {
    Some(match op {
        Op::Input => return None,
        Op::Dense(_) => Kind::Dense,
        Op::Convolution(layer) => Kind::Convolution {
            window: layer.window.into(),
        },
        Op::Pool(pool) => match pool.kind {
            PoolKind::Max => Kind::MaxPool {
                window: pool.window.into(),
            },
            kind => Kind::AveragePool {
                window: pool.window.into(),
                count_padding: kind == PoolKind::AverageWithPadding,
            },
        },
        Op::Reshape(shape) => Kind::Reshape {
            shape: shape.clone(),
        },
        Op::Permute(axes) => Kind::Permute { axes: axes.clone() },
        Op::Scale { .. } => Kind::Scale,
        Op::Activation(g) => Kind::Activation {
            function: (*g).into(),
        },
        Op::Softmax => Kind::Softmax,
        Op::Recurrent(layer) => {
            let (sequences, streaming) = (layer.sequences, layer.streaming);
            match layer.cell {
                Cell::Simple { activation } => Kind::SimpleRnn {
                    activation: activation.into(),
                    sequences,
                    streaming,
                },
                Cell::Gru {
                    activation,
                    gates,
                    reset_after,
                } => Kind::Gru {
                    activation: activation.into(),
                    gates: gates.into(),
                    reset_after,
                    sequences,
                    streaming,
                },
                Cell::Lstm { activation, gates } => Kind::Lstm {
                    activation: activation.into(),
                    gates: gates.into(),
                    sequences,
                    streaming,
                },
            }
        }
        Op::Add => Kind::Add,
        Op::Concatenate(axis) => Kind::Concatenate { axis: *axis },
    })
}

fn bytes<'a>(file: &SafeTensors<'a>, name: &str, kind: Dtype) -> Result<&'a [u8], NetworkError> {
    let wrong = |message: String| NetworkError::malformed(WEIGHTS_FILE, message);
    let tensor = file
        .tensor(name)
        .map_err(|_| wrong(format!("tensor {name:?} is missing")))?;
    if tensor.dtype() != kind {
        return Err(wrong(format!(
            "tensor {name:?} is {}: expected {kind}",
            tensor.dtype()
        )));
    }
    Ok(tensor.data())
}

fn floats(file: &SafeTensors<'_>, name: &str) -> Result<Vec<f32>, NetworkError> {
    let chunks = bytes(file, name, Dtype::F32)?.as_chunks().0;
    Ok(chunks.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

/// `golden.x` and `golden.y`, a row for each vector; none if the file has none.
fn golden(network: &Network, file: &SafeTensors<'_>) -> Result<Vec<Golden>, NetworkError> {
    let Ok(x) = file.tensor("golden.x") else {
        return Ok(Vec::new());
    };
    let rows = x.shape().first().copied().unwrap_or(0);
    if rows > MAX_GOLDEN {
        let message = format!("golden.x has {rows} rows: at most {MAX_GOLDEN} are kept");
        return Err(NetworkError::too_large(WEIGHTS_FILE, message));
    }
    let x = floats(file, "golden.x")?;
    let y: Vec<f64> = bytes(file, "golden.y", Dtype::F64)?
        .as_chunks()
        .0
        .iter()
        .map(|b| f64::from_le_bytes(*b))
        .collect();
    if rows == 0 || !x.len().is_multiple_of(rows) || y.len() != rows * network.outputs() {
        return Err(NetworkError::malformed(
            WEIGHTS_FILE,
            "golden.x and golden.y do not fit",
        ));
    }
    let pairs = x.chunks(x.len() / rows).zip(y.chunks(network.outputs()));
    Ok(pairs
        .map(|(x, y)| Golden {
            x: x.to_vec(),
            y: y.to_vec(),
        })
        .collect())
}

/// The files of a network by name; the same network gives the same bytes.
///
/// ```
/// use sinew_nn::{import, store};
///
/// let network = import::read("examples/mlp.onnx".as_ref())?;
/// let [(_, weights), (_, text)] = store::print(&network)?;
/// let text = String::from_utf8_lossy(&text);
/// assert!(text.starts_with("format = \"sinew-network/1\""));
/// assert_eq!(store::parse(&text, &weights)?, network);
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
///
/// # Errors
/// [`NetworkError`] if the network is not valid.
pub fn print(network: &Network) -> Result<[(&'static str, Vec<u8>); 2], NetworkError> {
    network.validate()?;
    let mut text = Text {
        format: FORMAT.into(),
        name: network.name.clone(),
        input: InputText {
            name: network.nodes[0].name.clone(),
            shape: network.nodes[0].shape.clone(),
        },
        layer: Vec::new(),
    };
    let mut tensors: Vec<(String, Dtype, Vec<usize>, Vec<u8>)> = Vec::new();
    for (place, node) in network.nodes.iter().enumerate() {
        let Some(kind) = kind(&node.op) else { continue };
        let names = node
            .from
            .iter()
            .map(|&from| network.nodes[from].name.clone());
        text.layer.push(LayerText {
            name: node.name.clone(),
            from: (node.from != [place - 1]).then(|| names.collect()),
            kind,
        });
        for (name, values) in node.op.tensors() {
            let bytes = values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect();
            tensors.push((
                format!("{}.{name}", node.name),
                Dtype::F32,
                vec![values.len()],
                bytes,
            ));
        }
    }
    if let Some(first) = network.golden.first() {
        let rows = network.golden.len();
        let x = network
            .golden
            .iter()
            .flat_map(|g| &g.x)
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let y = network
            .golden
            .iter()
            .flat_map(|g| &g.y)
            .flat_map(|v| v.to_le_bytes())
            .collect();
        tensors.push(("golden.x".into(), Dtype::F32, vec![rows, first.x.len()], x));
        tensors.push(("golden.y".into(), Dtype::F64, vec![rows, first.y.len()], y));
    }
    let views: Result<Vec<_>, _> = tensors
        .iter()
        .map(|(name, kind, shape, data)| {
            TensorView::new(*kind, shape.clone(), data).map(|view| (name, view))
        })
        .collect();
    let weights = views
        .and_then(|views| safetensors::serialize(views, None))
        .map_err(|error| NetworkError::caused("network", error))?;
    let text = toml::to_string(&text).map_err(|error| NetworkError::caused("network", error))?;
    Ok([(WEIGHTS_FILE, weights), (NETWORK_FILE, text.into_bytes())])
}

/// Validates `network` and writes it to `directory`; the description, which makes a folder a
/// network, last.
///
/// # Errors
/// [`NetworkError`] before anything is written, or if a file cannot be written.
pub fn save(directory: &Path, network: &Network) -> Result<(), NetworkError> {
    for (file, contents) in print(network)? {
        let path = directory.join(file);
        files::write(&path, &contents).map_err(|error| NetworkError::caused(file, error))?;
    }
    Ok(())
}
