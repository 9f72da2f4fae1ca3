//! Any network that is accepted is printed.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sinew_codegen::network::emit::{Options, emit};
use sinew_codegen::network::import;

fuzz_target!(|data: &[u8]| {
    if let Ok(network) = import::parse("a.onnx", data) {
        emit(&network, &Options::default()).expect("a valid network is printed");
    }
});
