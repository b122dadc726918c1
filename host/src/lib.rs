#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! The onboard program: sweeps and poses in, temporal scene flow out.

pub mod args;
pub mod backend;
pub mod budget;
pub mod choose;
pub mod config;
#[cfg(feature = "demo")]
pub mod demo;
pub mod drive;
pub mod engine;
pub mod error;
pub mod flow;
pub mod laps;
pub mod map;
pub mod order_statistics;
pub mod outputs;
pub mod progress;
pub mod report;
pub mod run;
pub mod statistics;
pub mod summary;
pub mod team;
pub mod track;
