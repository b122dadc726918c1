//! Parquet files row by row: numbers, and lists of them.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int8Type, Int32Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::ColumnChunkMetaData;

use super::images::Image;
use super::thrift::{self, PageHeader};
use crate::Error;
use crate::source::decoder::guarded;
use crate::source::whole::{self, unpacked_max};

/// Maximum accepted count of numbers in an image: six for each of 64 x 2650 pixels are less than a
/// tenth.
const NUMBERS_MAX: usize = 1 << 24;
/// Maximum accepted count of numbers in a column of a row group, 1 GiB of float32: twice that of
/// the images of 200 sweeps. A few bytes can declare that a number is repeated any number of times.
const COLUMN_MAX: u64 = 1 << 28;
/// Maximum accepted number of rows. A segment has five per sweep, about 1,000.
const ROWS_MAX: usize = 1 << 20;
/// Bytes that are first read for the header of a page: most have fewer than 100.
const HEADER_BYTES: u64 = 1024;
/// Rows that are decoded at once if rows are small.
const BATCH: usize = 256;

/// An open file.
pub(super) struct ParquetTable {
    path: PathBuf,
    file: File,
    metadata: ArrowReaderMetadata,
    /// Maximum count of numbers in a column of a row group.
    numbers_max: u64,
}

/// A row of a batch.
pub(super) struct TableRow<'a> {
    path: &'a Path,
    batch: &'a RecordBatch,
    row: usize,
}

/// Large rows, decoded one after another.
pub(super) struct ImageRows {
    table: ParquetTable,
    /// Indices of the columns that are read.
    roots: Vec<usize>,
    reader: ParquetRecordBatchReader,
    /// Index of the next row.
    next: usize,
}

impl ParquetTable {
    pub fn open(path: &Path) -> Result<ParquetTable, Error> {
        let (file, length) = whole::open(path)?;
        check_footer(&file, length).map_err(|e| Error::input(path, "", e.to_string()))?;
        let metadata = guarded(path, || ArrowReaderMetadata::load(&file, Default::default()))?;
        let metadata = metadata.map_err(|e| Error::input(path, "", e.to_string()))?;
        let numbers_max = COLUMN_MAX.min(unpacked_max(length) / size_of::<f32>() as u64);
        Ok(ParquetTable { path: path.to_path_buf(), file, metadata, numbers_max })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads columns from the first row on.
    fn reader(&self, roots: &[usize], batch: usize) -> Result<ParquetRecordBatchReader, Error> {
        let file = self.file.try_clone().map_err(Error::reading(&self.path))?;
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.metadata.clone());
        let mask = ProjectionMask::roots(builder.parquet_schema(), roots.iter().copied());
        let builder = builder.with_projection(mask).with_batch_size(batch);
        let reader = guarded(&self.path, || builder.build())?;
        reader.map_err(|e| Error::input(&self.path, "", e.to_string()))
    }

    /// Indices of columns by their names. Fails if one is missing, or has more numbers than
    /// accepted.
    fn find(&self, columns: &[&str]) -> Result<Vec<usize>, Error> {
        let named = self.metadata.schema().fields();
        let find = |column: &&str| {
            let found = named.iter().position(|field| field.name() == column);
            let at = || format!("column `{column}`");
            let root = found.ok_or_else(|| Error::input(&self.path, at(), "is missing"))?;
            // A row without a list is padded to the length of its type.
            if fixed_size(named[root].data_type()).saturating_mul(BATCH as u64) > self.numbers_max {
                return Err(Error::input(&self.path, at(), "has lists of too many numbers"));
            }
            self.check_size(root, self.numbers_max as usize).map(|()| root)
        };
        columns.iter().map(find).collect()
    }

    /// Checks that a column has at most this many numbers in each row group, according to its
    /// pages, which are what is decoded.
    fn check_size(&self, root: usize, most: usize) -> Result<(), Error> {
        let schema = self.metadata.parquet_schema();
        let groups = self.metadata.metadata().row_groups();
        for (n, group) in groups.iter().enumerate() {
            for (leaf, chunk) in group.columns().iter().enumerate() {
                if schema.get_column_root_idx(leaf) == root {
                    let numbers = guarded(&self.path, || self.numbers(chunk))?;
                    let wrong = |what| Error::input(&self.path, format!("row group {n}"), what);
                    if numbers.map_err(|e| wrong(e.to_string()))? > most {
                        return Err(wrong(format!("unpacks to more than {most} numbers")));
                    }
                }
            }
        }
        Ok(())
    }

    /// Counts the numbers in the pages of a column, dictionaries included, and those for which a
    /// page asks memory if they are more. Fails if the header of a page is not safe to pass to its
    /// decoder.
    fn numbers(&self, chunk: &ColumnChunkMetaData) -> Result<usize, ParquetError> {
        let (mut from, length) = chunk.byte_range();
        let end = from.saturating_add(length);
        let (mut count, mut largest) = (0_usize, 0);
        while from < end {
            let header = self.page_header(from..end)?;
            count = count.saturating_add(header.values);
            largest = largest.max(header.unpacked / size_of::<f64>());
            from += (header.length + header.packed) as u64;
        }
        Ok(count.max(largest))
    }

    /// The header of the page that begins there.
    fn page_header(&self, within: Range<u64>) -> Result<PageHeader, ParquetError> {
        let left = within.end - within.start;
        let mut room = HEADER_BYTES;
        loop {
            let bytes = read_at(&self.file, within.start, room.min(left))?;
            match thrift::page_header(&bytes) {
                Some(header) => return Ok(header),
                None if room >= left => return Err(damaged("page header")),
                // Long if it has statistics of long strings.
                None => room *= 16,
            }
        }
    }

    /// Passes rows with these columns to `see`.
    pub fn each(
        &self,
        columns: &[&str],
        mut see: impl FnMut(&TableRow) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut reader = self.reader(&self.find(columns)?, BATCH)?;
        let mut seen = 0;
        while let Some(batch) = guarded(&self.path, || reader.next())? {
            let batch = batch.map_err(|e| Error::input(&self.path, "", e.to_string()))?;
            seen += batch.num_rows();
            if seen > ROWS_MAX {
                let what = format!("has more than {ROWS_MAX} rows");
                return Err(Error::input(&self.path, "", what));
            }
            let rows =
                (0..batch.num_rows()).map(|row| TableRow { path: &self.path, batch: &batch, row });
            rows.into_iter().try_for_each(|row| see(&row))?;
        }
        Ok(())
    }

    /// Rows with these columns, one after another.
    pub fn rows(self, columns: &[&str]) -> Result<ImageRows, Error> {
        let roots = self.find(columns)?;
        let reader = self.reader(&roots, 1)?;
        Ok(ImageRows { table: self, roots, reader, next: 0 })
    }
}

/// Fails if the footer of a file is not safe to pass to its decoder.
fn check_footer(file: &File, length: u64) -> Result<(), ParquetError> {
    let Some(at) = length.checked_sub(8) else { return Ok(()) };
    let end = read_at(file, at, 8)?;
    let size = u64::from(u32::from_le_bytes([end[0], end[1], end[2], end[3]]));
    // If it is not such a file, the decoder says so.
    let Some(from) = at.checked_sub(size) else { return Ok(()) };
    if thrift::is_footer(&read_at(file, from, size)?) { Ok(()) } else { Err(damaged("footer")) }
}

/// Reads this many bytes of a file, which has them.
fn read_at(mut file: &File, from: u64, count: u64) -> Result<Vec<u8>, ParquetError> {
    let mut bytes = vec![0; count as usize];
    file.seek(SeekFrom::Start(from))?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn damaged(what: &str) -> ParquetError {
    ParquetError::General(format!("damaged {what}"))
}

/// Count of numbers in a row of a type, whatever it contains.
fn fixed_size(kind: &DataType) -> u64 {
    match kind {
        DataType::FixedSizeList(of, count) => {
            fixed_size(of.data_type()).saturating_mul((*count).max(0) as u64)
        }
        DataType::List(of) | DataType::LargeList(of) | DataType::Map(of, _) => {
            fixed_size(of.data_type())
        }
        DataType::Struct(of) => {
            of.iter().map(|field| fixed_size(field.data_type())).fold(0, u64::saturating_add)
        }
        _ => 1,
    }
}

impl ImageRows {
    pub fn path(&self) -> &Path {
        &self.table.path
    }

    /// An image from its columns of numbers and shape. A row before the last one read is reached
    /// from the beginning of the file.
    pub fn image(&mut self, row: usize, values: &str, shape: &str) -> Result<Image, Error> {
        if row < self.next {
            self.reader = self.table.reader(&self.roots, 1)?;
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
            return Err(wrong(format!("an image of invalid shape {shape:?}")));
        };
        let list = row.list(values)?;
        let values = list.as_primitive_opt::<Float32Type>();
        let values = values.ok_or_else(|| wrong("an image that is not float32".into()))?;
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

    /// An integer.
    pub fn integer(&self, name: &str) -> Result<i64, Error> {
        let column = self.column(name)?;
        let wide = column.as_primitive_opt::<Int64Type>().map(|c| c.value(self.row));
        let narrow = || column.as_primitive_opt::<Int8Type>().map(|c| c.value(self.row).into());
        wide.or_else(narrow).ok_or_else(|| self.wrong(name, "is neither int64 nor int8"))
    }

    /// A number; NaN if it is null.
    pub fn number(&self, name: &str) -> Result<f64, Error> {
        let column = self.column(name)?.as_primitive_opt::<Float64Type>();
        let column = column.ok_or_else(|| self.wrong(name, "is not float64"))?;
        Ok(if column.is_null(self.row) { f64::NAN } else { column.value(self.row) })
    }

    /// A list of variable or fixed length.
    fn list(&self, name: &str) -> Result<ArrayRef, Error> {
        let column = self.column(name)?;
        let list = column.as_list_opt::<i32>().map(|c| c.value(self.row));
        let fixed = || column.as_fixed_size_list_opt().map(|c| c.value(self.row));
        list.or_else(fixed).ok_or_else(|| self.wrong(name, "is not a list"))
    }

    /// The numbers of a list; empty if it is null.
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
        floats.or_else(whole).ok_or_else(|| self.wrong(name, "is not a list of float64 or int32"))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::source::tests::Temp;
    use arrow_array::{FixedSizeListArray, ListArray, StringArray};
    use arrow_schema::Field;
    use parquet::arrow::ArrowWriter;

    /// Lists of a million numbers that are all missing: a file of some hundred bytes.
    #[test]
    fn excessive_padding() {
        let t = Temp::new();
        let path = t.write("x.parquet", b"");
        let field = Arc::new(Field::new("item", DataType::Float32, true));
        let none = FixedSizeListArray::new_null(field, 1 << 20, 2);
        let batch = RecordBatch::try_from_iter([("values", Arc::new(none) as _)]).unwrap();
        let mut writer =
            ArrowWriter::try_new(File::create(&path).unwrap(), batch.schema(), None).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        let e = ParquetTable::open(&path).unwrap().find(&["values"]).unwrap_err().to_string();
        assert!(e.ends_with("x.parquet, column `values`: has lists of too many numbers"), "{e}");
    }

    /// A million equal numbers in one row: a file of some hundred bytes.
    #[test]
    fn excessive_unpacked_sizes() {
        const MANY: usize = 1 << 20;
        let t = Temp::new();
        let path = t.write("x.parquet", b"");
        let values = [Some(vec![Some(1.0); MANY]), None, Some(vec![Some(2.0); 3])];
        let values = Arc::new(ListArray::from_iter_primitive::<Float32Type, _, _>(values)) as _;
        let few = [None::<Vec<Option<i32>>>, None, Some(vec![Some(1); 2])];
        let few = Arc::new(FixedSizeListArray::from_iter_primitive::<Int32Type, _, _>(few, 2)) as _;
        let long =
            Arc::new(StringArray::from(vec!["x".repeat(800), String::new(), "".into()])) as _;
        let columns = [("values", values), ("few", few), ("long", long)];
        let batch = RecordBatch::try_from_iter(columns).unwrap();
        let file = File::create(&path).unwrap();
        let mut writer = ArrowWriter::try_new(file, batch.schema(), None).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        assert!(path.metadata().unwrap().len() < 10_000);
        let table = ParquetTable::open(&path).unwrap();
        // The null counts too, and so do the dictionaries, of two numbers and of one.
        table.check_size(0, MANY + 6).unwrap();
        table.check_size(1, 5).unwrap();
        // A page of a few rows that asks for much memory.
        assert!(table.check_size(2, 110).is_ok() && table.check_size(2, 99).is_err());
        let e = table.check_size(0, MANY + 5).unwrap_err().to_string();
        assert!(e.contains("x.parquet, row group 0: unpacks to more than 1048581 numbers"), "{e}");
        assert_eq!(table.find(&["few", "values"]).unwrap(), [1, 0]);
    }
}
