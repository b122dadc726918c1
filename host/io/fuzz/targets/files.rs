#![no_main]
//! Files other than recordings and weights.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| raywake_fuzz::files(bytes));
