#![deny(unsafe_code)]
#![deny(missing_docs)]
//! The kernels and the order in which a device runs them.
//!
//! Each kernel mirrors a scalar function of `raywake-core`, its twin, at the same path under the
//! same name; `tests/` checks every kernel against its twin bit for bit.

pub mod schedule;

/// The compiled kernels: one static per entry point. Only here are modules declared safe to run:
/// naga has validated them, and `tests/` checks, also under the validation layer, that their
/// indices are those of their twins, which Rust checks.
#[allow(clippy::unreadable_literal, unsafe_code)]
pub mod kernel {
    use raywake_gpu::{Binding, Kernel, Spirv};
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}
