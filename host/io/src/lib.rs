#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Recordings in, results out.
//!
//! | module | subject |
//! |---|---|
//! | [`source`] | sweeps and poses: data sets, ROS recordings, captures, clouds, simulated drives |
//! | [`sink`] | tables, clouds, MCAP, Argoverse 2 submissions; each file whole or absent |
//! | [`error`] | errors in files and options, and their exit codes |

pub mod error;
pub mod sink;
pub mod source;

pub use error::Error;
