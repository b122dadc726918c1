#![no_main]
//! Weights of each kind.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| raywake_fuzz::weights(bytes));
