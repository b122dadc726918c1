//! Stand-in for [`BagSink`] in builds that cannot write messages; never constructed.

use std::path::PathBuf;

use raywake_core::output::PairFlows;
use raywake_core::sweep::Point;
use raywake_objects::tracked::TrackedObject;

use super::streams::{Content, StreamTargets};
use crate::Error;
use crate::source::SweepData;

/// A stream that cannot exist.
pub enum Absent {}

pub use Absent as BagSink;

impl Absent {
    /// Returns `None` if no stream is requested.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if one is.
    pub fn create(streams: &StreamTargets, _: u64, _: Content) -> Result<Option<Absent>, Error> {
        match streams.is_empty() {
            true => Ok(None),
            false => Err(Error::missing_feature("a stream of messages", "mcap")),
        }
    }

    /// Never called.
    pub fn since(&mut self, _: u64) {
        match *self {}
    }

    /// Never called.
    pub fn has_viewer(&self) -> bool {
        match *self {}
    }

    /// Never called.
    pub fn pair(&mut self, _: &SweepData, _: &PairFlows) -> Result<(), Error> {
        match *self {}
    }

    /// Never called.
    pub fn objects(&mut self, _: &SweepData, _: &[i32], _: &[TrackedObject]) -> Result<(), Error> {
        match *self {}
    }

    /// Never called.
    pub fn boxes(&mut self, _: &SweepData, _: &[TrackedObject]) -> Result<(), Error> {
        match *self {}
    }

    /// Never called.
    pub fn cloud(&mut self, _: &SweepData, _: &[Point]) -> Result<(), Error> {
        match *self {}
    }

    /// Never called.
    pub fn keep_incomplete(self) -> Option<Result<PathBuf, Error>> {
        match self {}
    }

    /// Never called.
    pub fn finish(self) -> Result<(), Error> {
        match self {}
    }
}
