#![no_main]
//! Packets of a live sensor.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| raywake_fuzz::packets(bytes));
