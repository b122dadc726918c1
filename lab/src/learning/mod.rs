//! Networks in floating point, for chapter 4 as printed: convolutions without padding, the losses
//! of pairs and of classes, dropout and Adam.
//!
//! Matrix products are `ndarray`'s, which uses the processor's widest vectors: a seed gives the
//! same numbers again on the same kind of processor, and nearly the same on another. Shipped
//! numbers are trained elsewhere ([`crate::train`]) and are the same everywhere.

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
