//! What is fuzzed: any bytes give an error or a value, never a panic.

use sinew_codegen::network::emit::{Options, Weights, emit as print};
use sinew_codegen::network::{import as importers, store as networks};
use sinew_codegen::store as models;

/// A target by its name.
pub const TARGETS: [(&str, fn(&[u8])); 5] = [
    ("import", import),
    ("emit", emit),
    ("network", network),
    ("model", model),
    ("rig", rig),
];

/// A file of another tool. The first byte chooses its name; HDF5, zip and TensorFlow Lite are known by their
/// own first bytes.
pub fn import(data: &[u8]) {
    let Some((first, data)) = data.split_first() else {
        return;
    };
    let name = ["a.onnx", "a.h5", "a.keras", "a.tflite"][usize::from(first % 4)];
    let _ = importers::parse(name, data);
}

/// Any network that is accepted is printed, either way.
pub fn emit(data: &[u8]) {
    let Some((_, bytes)) = data.split_first() else {
        return;
    };
    if let Ok(network) = importers::parse("a.onnx", bytes) {
        for weights in [Weights::Float32, Weights::Int8] {
            let options = Options {
                weights,
                ..Options::default()
            };
            print(&network, &options).expect("a valid network is printed");
        }
    }
}

/// `network.toml`, up to the first zero byte, and `weights.safetensors` after it.
pub fn network(data: &[u8]) {
    let (text, weights) = two(data);
    let _ = networks::parse(&text, weights);
}

/// `model.toml`, up to the first zero byte, and `weights.safetensors` after it.
pub fn model(data: &[u8]) {
    let (text, weights) = two(data);
    let _ = models::parse(&text, weights);
}

/// `rig.toml`.
pub fn rig(data: &[u8]) {
    let _ = sinew_sim::Rig::parse(&String::from_utf8_lossy(data), "rig.toml");
}

fn two(data: &[u8]) -> (std::borrow::Cow<'_, str>, &[u8]) {
    let end = data.iter().position(|byte| *byte == 0);
    let (text, rest) = data.split_at(end.unwrap_or(data.len()));
    (String::from_utf8_lossy(text), rest.get(1..).unwrap_or(&[]))
}
