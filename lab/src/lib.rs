#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! Everything off-board: simulated drives, training of the learned numbers, and evaluation.

pub mod check;
pub mod grid;
pub mod labels;
pub mod report;
pub mod train;
