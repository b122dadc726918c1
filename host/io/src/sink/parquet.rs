//! Tables of all sweeps in one Parquet file, one row group each.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

use super::Meta;
use super::atomic::Partial;
use super::table::TableWriter;
use crate::Error;

/// A file being written; it takes its name when it is finished.
pub struct ParquetFile {
    path: PathBuf,
    /// Set from the first table on, which determines the columns.
    begun: Option<(ArrowWriter<BufWriter<File>>, Partial)>,
}

impl ParquetFile {
    /// Nothing is written before the first table.
    pub fn new(path: &Path) -> ParquetFile {
        ParquetFile { path: path.to_path_buf(), begun: None }
    }

    /// Appends a row group; all tables must have the same columns and file metadata.
    pub fn append(&mut self, table: TableWriter, meta: Meta<'_>) -> Result<(), Error> {
        let batch = table.batch(meta).map_err(Error::writing(&self.path))?;
        let failed = |e| Error::writing(&self.path)(reason(e));
        let (writer, _) = match &mut self.begun {
            Some(begun) => begun,
            none => {
                let (partial, file) = Partial::create(&self.path)?;
                let codec = Compression::ZSTD(ZstdLevel::default());
                let properties = WriterProperties::builder().set_compression(codec).build();
                let writer = ArrowWriter::try_new(file, batch.schema(), Some(properties));
                none.insert((writer.map_err(failed)?, partial))
            }
        };
        writer.write(&batch).and_then(|()| writer.flush()).map_err(failed)
    }

    /// Completes the file; there is none if nothing was appended.
    pub fn finish(self) -> Result<(), Error> {
        let Some((writer, partial)) = self.begun else { return Ok(()) };
        writer.close().map_err(|e| Error::writing(&self.path)(reason(e)))?;
        partial.keep()
    }
}

/// The system's reason if there is one.
fn reason(e: ParquetError) -> io::Error {
    match e {
        ParquetError::External(e) => match e.downcast::<io::Error>() {
            Ok(e) => *e,
            Err(e) => io::Error::other(e),
        },
        other => io::Error::other(other),
    }
}
