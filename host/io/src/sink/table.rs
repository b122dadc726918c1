//! Named columns as an Arrow IPC file, or as part of a Parquet file.

#[cfg(feature = "arrow")]
use std::io;
use std::io::Write;
use std::path::Path;

use super::Meta;
use crate::Error;

macro_rules! values {
    ($($kind:ident $value:ty),*) => {
        /// Values of one column, by their type in the file.
        pub enum Values {
            $(#[doc = concat!("`", stringify!($value), "`.")] $kind(Vec<$value>),)*
        }

        $(impl From<Vec<$value>> for Values {
            fn from(values: Vec<$value>) -> Values {
                Values::$kind(values)
            }
        })*
    };
}

values!(
    F32 f32, Known Option<f32>, F64 f64, I32 i32, U8 u8, U32 u32, U64 u64, Bool bool, Text String
);

/// A table under construction.
#[derive(Default)]
pub struct TableWriter {
    columns: Vec<(String, Values)>,
}

impl TableWriter {
    /// Adds a column with one value per row; all columns must have the same length.
    pub fn column<R, V>(&mut self, name: &str, rows: &[R], value: impl Fn(&R) -> V)
    where
        Values: From<Vec<V>>,
    {
        let values: Vec<V> = rows.iter().map(value).collect();
        self.columns.push((name.to_owned(), values.into()));
    }

    /// Adds a column for each element of an array of every row.
    pub fn array<R, V: Copy, const N: usize>(
        &mut self,
        names: [&str; N],
        rows: &[R],
        value: impl Fn(&R) -> [V; N],
    ) where
        Values: From<Vec<V>>,
    {
        for (n, name) in names.iter().enumerate() {
            self.column(name, rows, |row| value(row)[n]);
        }
    }

    /// Joins the columns of two tables that have the same rows.
    pub fn beside(mut self, other: TableWriter) -> TableWriter {
        self.columns.extend(other.columns);
        self
    }

    /// Writes the table, compressed with Zstandard, which reduces a sweep's flow to a third. The
    /// metadata goes into the schema, with this program's version as `raywake`.
    pub fn write(self, path: &Path, meta: Meta<'_>) -> Result<(), Error> {
        let bytes = self.file(path, meta)?;
        super::atomic::write(path, |out| out.write_all(&bytes))
    }

    /// Returns the bytes of the file; `path` is for errors.
    #[cfg(feature = "arrow")]
    pub fn file(self, path: &Path, meta: Meta<'_>) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let batch = self.batch(meta).map_err(Error::writing(path))?;
        let written = arrow::write(&batch, &mut bytes).map_err(arrow::reason);
        written.map(|()| bytes).map_err(Error::writing(path))
    }

    /// The table in memory.
    #[cfg(feature = "arrow")]
    pub(super) fn batch(self, meta: Meta<'_>) -> io::Result<arrow_array::RecordBatch> {
        arrow::batch(self.columns, meta).map_err(arrow::reason)
    }

    /// Fails: this build does not support feather files.
    #[cfg(not(feature = "arrow"))]
    pub fn file(self, path: &Path, _: Meta<'_>) -> Result<Vec<u8>, Error> {
        Err(Error::missing_feature(path.display(), "arrow"))
    }
}

#[cfg(feature = "arrow")]
mod arrow {
    use std::collections::HashMap;
    use std::io::{self, Write};
    use std::sync::Arc;

    use arrow_array::{
        ArrayRef, BooleanArray, Float32Array, Float64Array, Int32Array, RecordBatch, StringArray,
        UInt8Array, UInt32Array, UInt64Array,
    };
    use arrow_ipc::CompressionType;
    use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
    use arrow_schema::{ArrowError, Field, Schema};

    use super::{Meta, Values};

    /// The columns with their metadata.
    pub fn batch(
        columns: Vec<(String, Values)>,
        meta: Meta<'_>,
    ) -> Result<RecordBatch, ArrowError> {
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns
            .into_iter()
            .map(|(name, column)| {
                let has_nulls = matches!(column, Values::Known(_));
                let array = array(column);
                (Field::new(name, array.data_type().clone(), has_nulls), array)
            })
            .unzip();
        let version = ("raywake", env!("CARGO_PKG_VERSION").to_owned());
        let meta: HashMap<String, String> =
            meta.iter().cloned().chain([version]).map(|(k, v)| (k.to_owned(), v)).collect();
        let schema = Schema::new(fields).with_metadata(meta);
        RecordBatch::try_new(Arc::new(schema), arrays)
    }

    /// Converts a column, without copying its numbers.
    fn array(column: Values) -> ArrayRef {
        match column {
            Values::F32(v) => Arc::new(Float32Array::from(v)),
            Values::Known(v) => Arc::new(Float32Array::from(v)),
            Values::F64(v) => Arc::new(Float64Array::from(v)),
            Values::I32(v) => Arc::new(Int32Array::from(v)),
            Values::U8(v) => Arc::new(UInt8Array::from(v)),
            Values::U32(v) => Arc::new(UInt32Array::from(v)),
            Values::U64(v) => Arc::new(UInt64Array::from(v)),
            Values::Bool(v) => Arc::new(BooleanArray::from(v)),
            Values::Text(v) => Arc::new(StringArray::from(v)),
        }
    }

    /// One batch as a file.
    pub fn write(batch: &RecordBatch, out: &mut impl Write) -> Result<(), ArrowError> {
        let codec = Some(CompressionType::ZSTD);
        let options = IpcWriteOptions::default().try_with_compression(codec)?;
        let mut writer = FileWriter::try_new_with_options(out, &batch.schema(), options)?;
        writer.write(batch)?;
        writer.finish()
    }

    /// The system's reason if there is one.
    pub fn reason(e: ArrowError) -> io::Error {
        match e {
            ArrowError::IoError(_, e) => e,
            other => io::Error::other(other),
        }
    }
}
