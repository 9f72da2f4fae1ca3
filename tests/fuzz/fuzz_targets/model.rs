//! See `sinew_fuzz::model`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_fuzz::model(data));
