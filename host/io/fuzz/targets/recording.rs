#![no_main]
//! Files of a recording.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| raywake_fuzz::recording(bytes));
