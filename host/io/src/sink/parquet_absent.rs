//! What stands for [`ParquetFile`] where there are none.

use std::path::Path;

use super::Meta;
use super::table::TableWriter;
use crate::Error;

/// No file.
pub struct NoParquet;

pub use NoParquet as ParquetFile;

impl NoParquet {
    /// For nothing.
    pub fn new(_: &Path) -> NoParquet {
        NoParquet
    }

    /// Fails with [`Error::Unsupported`].
    pub fn append(&mut self, _: TableWriter, _: Meta<'_>) -> Result<(), Error> {
        Err(Error::lacking("a Parquet file", "parquet"))
    }

    /// Nothing was written.
    pub fn finish(self) -> Result<(), Error> {
        Ok(())
    }
}
