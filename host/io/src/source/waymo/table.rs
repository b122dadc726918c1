//! Parquet files row by row: numbers, and lists of them.

use std::fs::File;
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int8Type, Int32Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
};

use super::images::Image;
use crate::Error;
use crate::source::decoder::guarded;

/// Numbers of an image that are believed: six of each of 64 x 2650 pixels are ten times less.
const NUMBERS_MAX: usize = 1 << 24;
/// Rows that are decoded at once where rows are small.
const BATCH: usize = 256;

/// An open file.
pub(super) struct ParquetTable {
    path: PathBuf,
    file: File,
    metadata: ArrowReaderMetadata,
}

/// A row of a batch.
pub(super) struct TableRow<'a> {
    path: &'a Path,
    batch: &'a RecordBatch,
    row: usize,
}

/// Rows that are decoded one after the other, where they are large.
pub(super) struct ImageRows {
    table: ParquetTable,
    columns: Vec<String>,
    reader: ParquetRecordBatchReader,
    /// Number of the row that comes next.
    next: usize,
}

impl ParquetTable {
    pub fn open(path: &Path) -> Result<ParquetTable, Error> {
        let file = File::open(path).map_err(Error::reading(path))?;
        let metadata = guarded(path, || ArrowReaderMetadata::load(&file, Default::default()))?;
        let metadata = metadata.map_err(|e| Error::input(path, "", e.to_string()))?;
        Ok(ParquetTable { path: path.to_path_buf(), file, metadata })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads some columns from the first row on. Fails where one is missing.
    fn reader(
        &self,
        columns: &[impl AsRef<str>],
        batch: usize,
    ) -> Result<ParquetRecordBatchReader, Error> {
        let file = self.file.try_clone().map_err(Error::reading(&self.path))?;
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.metadata.clone());
        let named = builder.schema().fields();
        let number = |column: &str| {
            let found = named.iter().position(|field| field.name() == column);
            let at = || format!("column `{column}`");
            found.ok_or_else(|| Error::input(&self.path, at(), "is missing"))
        };
        let roots = columns.iter().map(|c| number(c.as_ref())).collect::<Result<Vec<_>, _>>()?;
        let mask = ProjectionMask::roots(builder.parquet_schema(), roots);
        let builder = builder.with_projection(mask).with_batch_size(batch);
        let reader = guarded(&self.path, || builder.build())?;
        reader.map_err(|e| Error::input(&self.path, "", e.to_string()))
    }

    /// Hands out rows with these columns.
    pub fn each(
        &self,
        columns: &[&str],
        mut see: impl FnMut(&TableRow) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut reader = self.reader(columns, BATCH)?;
        while let Some(batch) = guarded(&self.path, || reader.next())? {
            let batch = batch.map_err(|e| Error::input(&self.path, "", e.to_string()))?;
            let rows =
                (0..batch.num_rows()).map(|row| TableRow { path: &self.path, batch: &batch, row });
            rows.into_iter().try_for_each(|row| see(&row))?;
        }
        Ok(())
    }

    /// Rows with these columns, one after the other.
    pub fn rows(self, columns: &[&str]) -> Result<ImageRows, Error> {
        let columns: Vec<String> = columns.iter().map(|&column| column.to_owned()).collect();
        let reader = self.reader(&columns, 1)?;
        Ok(ImageRows { table: self, columns, reader, next: 0 })
    }
}

impl ImageRows {
    pub fn path(&self) -> &Path {
        &self.table.path
    }

    /// An image from its columns of numbers and shape. What lies before the last one that was read
    /// is reached from the file's beginning.
    pub fn image(&mut self, row: usize, values: &str, shape: &str) -> Result<Image, Error> {
        if row < self.next {
            self.reader = self.table.reader(&self.columns, 1)?;
            self.next = 0;
        }
        let at = || format!("row {row}");
        let wrong = |what: String| Error::input(&self.table.path, at(), what);
        let skipped = row - self.next;
        let batch = guarded(&self.table.path, || self.reader.nth(skipped))?
            .ok_or_else(|| wrong("is missing".into()))?;
        self.next = row + 1;
        let batch = batch.map_err(|e| wrong(e.to_string()))?;
        let row = TableRow { path: &self.table.path, batch: &batch, row: 0 };
        let shape = row.numbers(shape)?;
        let size = |n: usize| shape.get(n).filter(|v| **v >= 0.0).map(|v| *v as usize);
        let (Some(rows), Some(columns), Some(channels), 3) =
            (size(0), size(1), size(2), shape.len())
        else {
            return Err(wrong(format!("an image of shape {shape:?}")));
        };
        let list = row.list(values)?;
        let values = list.as_primitive_opt::<Float32Type>();
        let values = values.ok_or_else(|| wrong("an image that is not of float32".into()))?;
        let pixels = rows.checked_mul(columns).and_then(|n| n.checked_mul(channels));
        if pixels.is_none_or(|n| n > NUMBERS_MAX || n != values.len()) {
            return Err(wrong(format!("{} numbers for an image of {shape:?}", values.len())));
        }
        Ok(Image { values: values.values().to_vec(), rows, columns, channels })
    }
}

impl TableRow<'_> {
    fn wrong(&self, column: &str, what: &str) -> Error {
        Error::input(self.path, format!("column `{column}`"), what)
    }

    fn column(&self, name: &str) -> Result<&ArrayRef, Error> {
        self.batch.column_by_name(name).ok_or_else(|| self.wrong(name, "is missing"))
    }

    /// A whole number.
    pub fn integer(&self, name: &str) -> Result<i64, Error> {
        let column = self.column(name)?;
        let wide = column.as_primitive_opt::<Int64Type>().map(|c| c.value(self.row));
        let narrow = || column.as_primitive_opt::<Int8Type>().map(|c| c.value(self.row).into());
        wide.or_else(narrow).ok_or_else(|| self.wrong(name, "is neither int64 nor int8"))
    }

    /// A number; NaN where there is none.
    pub fn number(&self, name: &str) -> Result<f64, Error> {
        let column = self.column(name)?.as_primitive_opt::<Float64Type>();
        let column = column.ok_or_else(|| self.wrong(name, "is not float64"))?;
        Ok(if column.is_null(self.row) { f64::NAN } else { column.value(self.row) })
    }

    /// A list, of any length or a fixed one.
    fn list(&self, name: &str) -> Result<ArrayRef, Error> {
        let column = self.column(name)?;
        let list = column.as_list_opt::<i32>().map(|c| c.value(self.row));
        let fixed = || column.as_fixed_size_list_opt().map(|c| c.value(self.row));
        list.or_else(fixed).ok_or_else(|| self.wrong(name, "is no list"))
    }

    /// The numbers of a list; none where it is null.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>, Error> {
        if self.column(name)?.is_null(self.row) {
            return Ok(Vec::new());
        }
        let list = self.list(name)?;
        let floats = list.as_primitive_opt::<Float64Type>().map(|v| v.values().to_vec());
        let whole = || {
            let values = list.as_primitive_opt::<Int32Type>()?.values().iter();
            Some(values.map(|v| f64::from(*v)).collect())
        };
        floats.or_else(whole).ok_or_else(|| self.wrong(name, "is no list of float64 or int32"))
    }
}
