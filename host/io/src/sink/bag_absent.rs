//! What stands for [`BagSink`] where MCAP files cannot be written: nothing makes one.

use std::path::Path;

use raywake_core::output::PairFlows;

use super::objects::{BoxMark, Content};
use crate::Error;
use crate::source::SweepData;

/// No file.
pub enum Absent {}

pub use Absent as BagSink;

impl Absent {
    /// Fails with [`Error::Unsupported`].
    pub fn create(path: &Path, _: u64, _: Content) -> Result<Absent, Error> {
        let what = "an MCAP file needs the feature `mcap`, which is not compiled in";
        Err(Error::Unsupported(format!("{}: {what}", path.display())))
    }

    /// Never called.
    pub fn pair(&mut self, _: &SweepData, _: &PairFlows) -> Result<(), Error> {
        match *self {}
    }

    /// Never called.
    pub fn objects(
        &mut self,
        _: &SweepData,
        _: &[i32],
        _: impl Iterator<Item = BoxMark>,
    ) -> Result<(), Error> {
        match *self {}
    }

    /// Never called.
    pub fn finish(self) -> Result<(), Error> {
        match self {}
    }
}
