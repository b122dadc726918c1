#![no_main]
//! Datagrams of poses.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| raywake_fuzz::poses(bytes));
