#![cfg_attr(not(feature = "std"), no_std)]
#![deny(missing_docs)]
//! Temporal scene flow for other programs: a [`FlowEstimator`] lives in memory that it is given,
//! keeps the two sweeps it works on, and returns the flow from one to the other.
//!
//! The C library, the Python module and programs without an operating system are built on it. It
//! runs on the CPU, with the shipped weights. With the feature `std`, a [`TeamEstimator`] adds its
//! own threads and the processor's widest instructions; without it, the crate is `no_std`. Neither
//! estimator allocates after its creation; the plain one not even then.

mod estimator;
mod memory;
mod options;
mod place;
mod records;
mod returns;
mod summary;
#[cfg(feature = "std")]
mod team_estimator;

pub use estimator::FlowEstimator;
pub use memory::Memory;
pub use options::{CreateError, EstimatorOptions};
pub use place::{SweepError, SweepPlace};
pub use raywake_objects::front_end::TRACKS_MAX as OBJECTS_MAX;
pub use records::{ColumnRecord, NO_CLASS, ObjectRecord, PointRecord, TrackletRecord};
pub use returns::{ReturnSource, ReturnsBy};
pub use summary::{PairSummary, StepSummary};
#[cfg(feature = "std")]
pub use team_estimator::{ReceivedStep, StepError, TeamError, TeamEstimator};
