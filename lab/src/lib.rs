#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Everything off-board: simulated drives, training of the learned numbers, and evaluation.

pub mod bench;
mod curve;
pub mod device;
pub mod eval;
pub mod flsf;
pub mod grid;
pub mod growth;
pub mod instructions;
pub mod labels;
mod learning;
pub mod matching;
pub mod metrics;
mod program;
pub mod report;
pub mod results;
#[cfg(test)]
mod scratch;
pub mod simulate;
pub mod soak;
pub mod toy;
pub mod tracks;
pub mod train;
