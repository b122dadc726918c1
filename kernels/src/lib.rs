#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! The kernels and the order in which a device runs them.
//!
//! Each kernel mirrors a scalar function of `raywake-core`, its twin, at the same path under the
//! same name; `tests/` holds every kernel to its twin bit for bit.

pub mod schedule;

/// The kernels, compiled: one static per entry point.
#[allow(clippy::unreadable_literal)]
pub mod kernel {
    use raywake_gpu::{Binding, Kernel};
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}
