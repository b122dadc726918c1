#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Recordings in, results out.
//!
//! | module | subject |
//! |---|---|
//! | [`source`] | sweeps and poses of KITTI, Argoverse 2, folders of clouds, simulated drives |
//! | [`sink`] | feather tables, Argoverse 2 submissions, each file whole or absent |
//! | [`error`] | errors in files and options, and their exit codes |

pub mod error;
pub mod sink;
pub mod source;

pub use error::Error;
