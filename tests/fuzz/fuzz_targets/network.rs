//! See `sinew_fuzz::network`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_fuzz::network(data));
