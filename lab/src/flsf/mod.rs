//! Feature learning for scene flow as printed in the dissertation (chapter 4): a network of six
//! convolutions on the occupancy of a sweep in the vehicle's frame, trained on pairs of cells.
//!
//! For the record, off-board: 41.9 billion products a sweep. What ships is
//! [`raywake_core::encoder`].

mod conclude;
mod crops;
mod distances;
pub mod evaluate;
mod matching;
mod network;
mod occupancy;
mod outcome;
mod pairs;
mod tally;
#[cfg(test)]
mod tests;
mod train;
mod weights;

pub use train::{Args, run};
