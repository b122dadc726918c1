//! Networks in floating point, for chapter 4 as printed: convolutions without padding, the losses
//! of pairs and of classes, dropout and Adam.
//!
//! Products of matrices are `ndarray`'s, which asks the processor for its widest vectors: a seed
//! gives the same numbers again on the same kind of processor, and nearly the same on another. What
//! ships is trained elsewhere ([`crate::train`]), the same everywhere.

mod adam;
pub mod checkpoint;
mod convolution;
mod losses;
mod network;
#[cfg(test)]
mod tests;

pub use adam::Adam;
pub use convolution::{Activation, Convolution, FeatureMap};
pub use losses::{cross_entropy, pair_loss};
pub use network::FeatureNetwork;
