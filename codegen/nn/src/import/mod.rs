//! Networks of other tools. Each importer is given a whole file in memory and makes a [`Network`];
//! what it does not know it refuses, naming the layer and the nearest thing that would work.

mod composite;
mod groups;
mod hdf5;
mod keras;
mod onnx;
mod pads;
mod shapes;
mod tensor;
mod tflite;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::limits::MAX_FILE_BYTES;
use super::rounding::Rounding;
use super::{Network, NetworkError, store};

/// Format of a file, by its first bytes and its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// ONNX.
    Onnx,
    /// Keras 2, or Keras 3 in the old format: HDF5.
    KerasH5,
    /// Keras 3: a zip archive.
    Keras,
    /// TensorFlow Lite.
    TfLite,
}

impl Format {
    /// The format of a file.
    #[must_use]
    pub fn of(name: &str, bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
            return Some(Self::KerasH5);
        }
        if bytes.starts_with(b"PK\x03\x04") {
            return Some(Self::Keras);
        }
        if bytes.get(4..8) == Some(b"TFL3") {
            return Some(Self::TfLite);
        }
        // A protocol buffer has no magic number.
        name.to_lowercase().ends_with(".onnx").then_some(Self::Onnx)
    }
}

/// The network in a file of another tool, or in a folder with `network.toml`.
///
/// # Errors
/// [`NetworkError`], beginning with the path.
pub fn read(path: &Path) -> Result<Network, NetworkError> {
    let place = path.display().to_string();
    if path.is_dir() {
        if path.join(store::NETWORK_FILE).is_file() {
            return store::load(path);
        }
        let message = format!(
            "{} is missing: expected a folder of `sinew import`",
            store::NETWORK_FILE
        );
        return Err(NetworkError::malformed(place, message));
    }
    let (name, bytes) = contents(path)?;
    parse(&name, &bytes).map_err(|error| error.within(&place))
}

/// The rounding between layers of a quantised file, which its framework does and the network here
/// does not; none for other files, and for folders.
///
/// # Errors
/// [`NetworkError`] if the file cannot be read.
pub fn rounding(path: &Path) -> Result<Option<Rounding>, NetworkError> {
    if path.is_dir() {
        return Ok(None);
    }
    let (name, bytes) = contents(path)?;
    match Format::of(&name, &bytes) {
        Some(Format::TfLite) => tflite::rounding::of(&bytes),
        Some(Format::Keras) => Ok(keras::rounding(&bytes, true)),
        Some(Format::KerasH5) => Ok(keras::rounding(&bytes, false)),
        Some(Format::Onnx) | None => Ok(None),
    }
}

/// Name and contents of a file.
fn contents(path: &Path) -> Result<(String, Vec<u8>), NetworkError> {
    let mut bytes = Vec::new();
    // The limit holds for what is read, not for what the file system claims: it may be a device.
    File::open(path)
        .and_then(|file| file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|error| NetworkError::caused(path.display().to_string(), error))?;
    let name = path
        .file_name()
        .map_or_else(String::new, |name| name.to_string_lossy().into());
    Ok((name, bytes))
}

/// The network in the contents of a file called `name`.
///
/// ```
/// use sinew_nn::import;
///
/// let network = import::parse("mlp.onnx", &std::fs::read("examples/mlp.onnx")?)?;
/// assert_eq!((network.inputs(), network.outputs()), (12, 3));
///
/// let error = import::parse("notes.txt", b"no network").unwrap_err();
/// assert!(error.to_string().contains("expected .onnx, .h5, .keras, .tflite"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`NetworkError`] if the contents are no network, or one that cannot be emitted.
pub fn parse(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(NetworkError::too_large(
            "file",
            format!("larger than {MAX_FILE_BYTES} bytes"),
        ));
    }
    let crate_name = package_name(name);
    let mut network = match Format::of(name, bytes) {
        Some(Format::Onnx) => onnx::import(&crate_name, bytes),
        Some(Format::KerasH5) => keras::import_h5(&crate_name, bytes),
        Some(Format::Keras) => keras::import_archive(&crate_name, bytes),
        Some(Format::TfLite) => tflite::import(&crate_name, bytes),
        None => Err(NetworkError::malformed(
            "file",
            "this is no network: expected .onnx, .h5, .keras, .tflite, or a folder with network.toml",
        )),
    }?;
    network.drop_unread();
    network.validate()?;
    Ok(network)
}

/// A package name from a file name.
fn package_name(file: &str) -> String {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let mut name = String::new();
    for c in stem.chars().take(60) {
        if c.is_ascii_alphanumeric() {
            name.push(c.to_ascii_lowercase());
        } else if !name.is_empty() && !name.ends_with('-') {
            name.push('-');
        }
    }
    let name = name.trim_end_matches('-');
    if name.starts_with(|c: char| c.is_ascii_lowercase()) {
        name.into()
    } else {
        format!("network-{name}").trim_end_matches('-').into()
    }
}

/// A recurrent layer's bias, and the inner one of a GRU whose reset comes after the product: there
/// the bias of the input comes first, then that of the state, and for the gates the two add up.
fn gru_bias(bias: &[f32], rows: usize, units: usize, reset_after: bool) -> (Vec<f32>, Vec<f32>) {
    if !reset_after {
        return (bias.to_vec(), Vec::new());
    }
    let (input, state) = bias.split_at(rows);
    let gates = rows - units;
    let sum = input.iter().zip(state).enumerate();
    let sum = sum.map(|(i, (a, b))| if i < gates { a + b } else { *a });
    (sum.collect(), state[gates..].to_vec())
}

/// IEEE 754 half precision.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let exponent = i32::from(bits >> 10 & 31);
    let fraction = f64::from(bits & 1023) / 1024.0;
    sign * match exponent {
        0 => fraction * (-14_f64).exp2(),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * f64::from(exponent - 15).exp2(),
    }
}
