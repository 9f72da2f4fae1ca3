//! See `sinew_codegen_fuzz::import`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_codegen_fuzz::import(data));
