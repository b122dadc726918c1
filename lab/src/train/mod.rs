//! `raywake-lab train`: the learned numbers of chapter 3.

#![allow(missing_docs)]
pub mod constancy_samples;
pub mod curve;
pub mod drives;
pub mod features;
pub mod filter_samples;
pub mod logistic;
pub mod owner;
pub mod pairs;
pub mod recorded;
pub mod simulated;
mod solve;
pub mod weights_file;

pub use features::LEVELS;
