//! Reading of a network's two files.

use std::collections::HashMap;
use std::path::Path;

use safetensors::{Dtype, SafeTensors};

use super::text::{Kind, Text};
use super::{FORMAT, NETWORK_FILE, WEIGHTS_FILE};
use crate::limits::{MAX_FILE_BYTES, MAX_GOLDEN};
use crate::{
    Cell, Convolution, Dense, Golden, Network, NetworkError, Op, Pool, PoolKind, Recurrent,
    Selection,
};

/// Larger than any description that the limits admit.
const MAX_TEXT_BYTES: u64 = 1024 * 1024;

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
        sinew_files::read(&path, max).map_err(|error| NetworkError::caused(file, error))
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
    crate::shape::check(&text.input.name, &text.input.shape)?;
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
    let recurrent = |cell: Cell, sequences: bool, streaming: bool| {
        recurrent(layer, file, cell, (sequences, streaming))
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
        Kind::LogSoftmax => Op::LogSoftmax,
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
        Kind::Multiply => Op::Multiply,
        Kind::Maximum => Op::Maximum,
        Kind::Minimum => Op::Minimum,
        Kind::Select { shape, places } => {
            let place =
                |&place: &i64| (place != -1).then(|| place.try_into().unwrap_or(usize::MAX));
            let places = places.iter().map(place).collect();
            Op::Select(Selection { places, shape })
        }
        Kind::Normalise { epsilon } => Op::Normalise { epsilon },
        Kind::Concatenate { axis } => Op::Concatenate(axis),
    })
}

fn recurrent(
    layer: &str,
    file: &SafeTensors<'_>,
    cell: Cell,
    (sequences, streaming): (bool, bool),
) -> Result<Op, NetworkError> {
    let list = |name: &str| floats(file, &format!("{layer}.{name}"));
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
