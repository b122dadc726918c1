#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! The onboard program: sweeps and poses in, temporal scene flow out.

pub mod backend;
pub mod drive;
pub mod error;
pub mod laps;
pub mod sink;
pub mod source;
