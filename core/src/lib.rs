#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Temporal scene flow from LIDAR (Ushani 2018, chapter 3 and appendix B) as scalar functions over
//! caller-owned storage: no allocation, no operating system, no unsafe code.
//!
//! ```text
//!  returns, pose       rays            grid             columns           foreground
//! ┌───────────┐  ┌──────────────┐  ┌──────────┐  ┌─────────────────┐  ┌─────────────────┐
//! │  prepare  ├─►│ merge, trace ├─►│ log-odds ├─►│ free / occupied ├─►│ learned filter  │
//! └───────────┘  └──────────────┘  └──────────┘  └─────────────────┘  └────────┬────────┘
//!                                                                              ▼
//! ┌───────────┐  ┌──────────────┐  ┌──────────┐  ┌─────────────────┐  ┌─────────────────┐
//! │ velocities│◄─┤ EKF tracklets│◄─┤  refine  │◄─┤ expectation-max.│◄─┤  constancy cost │
//! └───────────┘  └──────────────┘  └──────────┘  └─────────────────┘  └─────────────────┘
//! ```
//! That is figure 3.1 of the dissertation; [`pipeline::Pipeline::step`] implements it.
//!
//! - A sweep: [`sweep`] (returns, rig), [`return_clock`] (the time of a return), [`continuity`]
//!   (what makes two sweeps a pair), [`prepare`] and [`returns`] (rays), [`frame`] (the window).
//! - From rays to flow: [`stages`] (buffers, stages and their order), [`perceive`] (what runs
//!   them), [`record`] (data exchanged with a device).
//! - Column classes: [`encoder`] (after chapter 4).
//! - From flow to velocities: [`refinement`], [`tracklet`], [`motion_compensation`], [`output`].
//! - The sparse map of appendix B: [`map`].
//! - Supporting modules: [`mod@params`], [`weights`], [`team`] (threads), [`digest`],
//!   [`mod@counters`], [`dropped`], [`thinning`], [`ground`], [`groups`], [`pose`],
//!   [`plausible`], [`ctrv`].

#[cfg(feature = "pipeline")]
mod column_set;
pub mod continuity;
#[cfg(feature = "pipeline")]
pub mod counters;
#[cfg(feature = "pipeline")]
pub mod ctrv;
pub mod digest;
#[cfg(feature = "pipeline")]
pub mod dropped;
#[cfg(feature = "pipeline")]
pub mod encoder;
#[cfg(feature = "pipeline")]
pub mod frame;
#[cfg(feature = "pipeline")]
pub mod ground;
#[cfg(feature = "pipeline")]
pub mod groups;
#[cfg(feature = "pipeline")]
pub mod map;
#[cfg(feature = "pipeline")]
pub mod motion_compensation;
mod neighbours;
#[cfg(feature = "pipeline")]
pub mod output;
pub mod params;
#[cfg(feature = "pipeline")]
pub mod perceive;
#[cfg(feature = "pipeline")]
pub mod pipeline;
pub mod plausible;
pub mod pose;
#[cfg(feature = "pipeline")]
pub mod prepare;
#[cfg(test)]
mod random;
pub mod record;
#[cfg(feature = "pipeline")]
pub mod refinement;
#[cfg(feature = "pipeline")]
pub mod return_clock;
#[cfg(feature = "pipeline")]
pub mod returns;
#[cfg(feature = "pipeline")]
mod sensor_paths;
pub mod stages;
#[cfg(feature = "pipeline")]
pub mod sweep;
pub mod team;
#[cfg(feature = "pipeline")]
pub mod thinning;
#[cfg(feature = "pipeline")]
pub mod tracklet;
#[cfg(feature = "pipeline")]
mod velocities;
pub mod weights;
