#![deny(unsafe_code)]
#![deny(missing_docs)]
//! The kernels and the order in which a device runs them.
//!
//! Each kernel mirrors a scalar function of `raywake-core`, its twin, at the same path under the
//! same name; `tests/` holds every kernel to its twin bit for bit.

pub mod schedule;

/// The kernels, compiled: one static per entry point. Only here is it said of modules that they may
/// be run: naga has validated them, and that their indices are those of their twins, which Rust
/// checks, is what `tests/` holds them to, also under the validation layer's own checks.
#[allow(clippy::unreadable_literal, unsafe_code)]
pub mod kernel {
    use raywake_gpu::{Binding, Kernel, Spirv};
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}
