//! See `sinew_fuzz::log`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_fuzz::log(data));
