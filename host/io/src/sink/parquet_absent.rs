//! Stand-in for [`ParquetFile`] in builds without Parquet.

use std::path::Path;

use super::Meta;
use super::table::TableWriter;
use crate::Error;

/// A file to which nothing can be written.
pub struct NoParquet;

pub use NoParquet as ParquetFile;

impl NoParquet {
    /// Does nothing.
    pub fn new(_: &Path) -> NoParquet {
        NoParquet
    }

    /// Fails with [`Error::Unsupported`].
    pub fn append(&mut self, _: TableWriter, _: Meta<'_>) -> Result<(), Error> {
        Err(Error::missing_feature("a Parquet file", "parquet"))
    }

    /// Does nothing: nothing was written.
    pub fn finish(self) -> Result<(), Error> {
        Ok(())
    }
}
