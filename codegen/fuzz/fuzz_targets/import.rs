//! Any bytes as a file of each kind: an error or a network, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sinew_codegen::network::import;

fuzz_target!(|data: &[u8]| {
    // The first byte chooses the name; HDF5, zip and TensorFlow Lite are known by their own first bytes.
    let Some((first, data)) = data.split_first() else { return };
    let name = ["a.onnx", "a.h5", "a.keras", "a.tflite"][usize::from(first % 4)];
    let _ = import::parse(name, data);
});
