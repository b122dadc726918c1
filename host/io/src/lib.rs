#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Recordings in, results out.
//!
//! | module | subject |
//! |---|---|
//! | [`source`] | sweeps and poses of recorded (KITTI, Argoverse 2, folders of clouds) and simulated drives |
//! | [`sink`] | feather tables, Argoverse 2 submissions, each file whole or absent |
//! | [`error`] | what can be wrong with a file, and the exit code of it |

pub mod error;
pub mod sink;
pub mod source;

pub use error::Error;
