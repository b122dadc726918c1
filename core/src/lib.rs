#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Temporal scene flow from LIDAR (Ushani 2018, chapter 3 and appendix B) as scalar functions over
//! caller-owned storage: no allocation, no operating system, no unsafe code.

pub mod continuity;
pub mod counters;
pub mod ctrv;
pub mod digest;
pub mod dropped;
pub mod frame;
pub mod ground;
pub mod groups;
pub mod map;
pub mod motion_compensation;
pub mod output;
pub mod params;
pub mod perceive;
pub mod pipeline;
pub mod pose;
pub mod prepare;
#[cfg(test)]
mod random;
pub mod record;
pub mod refinement;
pub mod return_clock;
pub mod returns;
pub mod stages;
pub mod sweep;
pub mod team;
pub mod tracklet;
mod velocities;
pub mod weights;
