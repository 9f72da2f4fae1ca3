//! See `sinew_fuzz::emit`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sinew_fuzz::emit(data));
