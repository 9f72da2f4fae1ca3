//! See `sinew_fuzz::mechanism`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_fuzz::mechanism(data));
