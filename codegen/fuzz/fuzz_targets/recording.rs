//! See `sinew_codegen_fuzz::recording`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_codegen_fuzz::recording(data));
