//! Writing of a network's two files.

use std::path::Path;

use safetensors::Dtype;
use safetensors::tensor::TensorView;

use super::text::{InputText, Kind, LayerText, Text};
use super::{FORMAT, NETWORK_FILE, WEIGHTS_FILE};
use crate::{Cell, Network, NetworkError, Op, PoolKind};

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
        sinew_files::write(&path, &contents).map_err(|error| NetworkError::caused(file, error))?;
    }
    Ok(())
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
        Op::LogSoftmax => Kind::LogSoftmax,
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
        Op::Multiply => Kind::Multiply,
        Op::Maximum => Kind::Maximum,
        Op::Minimum => Kind::Minimum,
        Op::Select(selection) => {
            let place = |place: &Option<usize>| place.map_or(-1, |place| place as i64);
            Kind::Select {
                shape: selection.shape.clone(),
                places: selection.places.iter().map(place).collect(),
            }
        }
        Op::Normalise { epsilon } => Kind::Normalise { epsilon: *epsilon },
        Op::Concatenate(axis) => Kind::Concatenate { axis: *axis },
    })
}
