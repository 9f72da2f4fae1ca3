//! See `sinew_codegen_fuzz::model`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_codegen_fuzz::model(data));
