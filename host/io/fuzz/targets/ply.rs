#![no_main]
//! `.ply` as a recording.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| raywake_fuzz::recording("ply", bytes));
