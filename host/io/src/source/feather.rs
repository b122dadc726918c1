//! Columns of a feather file (an Arrow IPC file), in any number of record batches, compressed or
//! not.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Float16Type, Float32Type, Float64Type, Int8Type, Int32Type, Int64Type,
    UInt8Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, RecordBatch};
use arrow_ipc::reader::FileReaderBuilder;
use arrow_schema::{ArrowError, DataType};

use super::decoder::guarded;
use super::{feather_check, whole};
use crate::Error;

/// The requested columns of a file.
pub struct FeatherTable {
    path: PathBuf,
    batches: Vec<RecordBatch>,
}

impl FeatherTable {
    /// Reads `columns`. Fails if the file is unreadable or damaged, or lacks one of them.
    pub fn read(path: &Path, columns: &[&str]) -> Result<FeatherTable, Error> {
        FeatherTable::parse(path, &whole::read(path)?, columns)
    }

    /// Parses `columns` from the contents of the file at `path`.
    pub fn parse(path: &Path, bytes: &[u8], columns: &[&str]) -> Result<FeatherTable, Error> {
        feather_check::check(bytes).map_err(|what| Error::input(path, "", what))?;
        let batches = guarded(path, || batches(path, bytes, columns))??;
        Ok(FeatherTable { path: path.to_path_buf(), batches })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }

    /// A column of floats of any width; null becomes NaN.
    pub fn floats(&self, name: &str) -> Result<Vec<f64>, Error> {
        self.gather(name, "floats", |column, out| {
            match column.data_type() {
                DataType::Float16 => extend::<Float16Type, f64>(column, out),
                DataType::Float32 => extend::<Float32Type, f64>(column, out),
                DataType::Float64 => extend::<Float64Type, f64>(column, out),
                _ => return false,
            }
            true
        })
        .map(|values| values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect())
    }

    /// Three columns of floats, by row.
    pub fn vectors(&self, [x, y, z]: [&str; 3]) -> Result<Vec<[f32; 3]>, Error> {
        let [x, y, z] = [self.floats(x)?, self.floats(y)?, self.floats(z)?];
        Ok((0..self.rows()).map(|row| [x[row], y[row], z[row]].map(|v| v as f32)).collect())
    }

    /// A column of integers (u8, i8, i32, u32, i64, u64). Fails at a null or a value beyond i64.
    pub fn integers(&self, name: &str) -> Result<Vec<i64>, Error> {
        let values = self.gather(name, "integers", |column, out| {
            match column.data_type() {
                DataType::UInt8 => extend::<UInt8Type, i64>(column, out),
                DataType::UInt32 => extend::<UInt32Type, i64>(column, out),
                DataType::Int8 => extend::<Int8Type, i64>(column, out),
                DataType::Int32 => extend::<Int32Type, i64>(column, out),
                DataType::Int64 => extend::<Int64Type, i64>(column, out),
                DataType::UInt64 => extend::<UInt64Type, i64>(column, out),
                _ => return false,
            }
            true
        })?;
        self.filled(name, values)
    }

    /// A column of booleans. Fails at a null.
    pub fn booleans(&self, name: &str) -> Result<Vec<bool>, Error> {
        let values = self.gather(name, "booleans", |column, out| {
            let booleans = column.as_boolean_opt();
            booleans.iter().for_each(|values| out.extend(values.iter()));
            booleans.is_some()
        })?;
        self.filled(name, values)
    }

    /// A column of text; null becomes the empty string.
    pub fn strings(&self, name: &str) -> Result<Vec<String>, Error> {
        self.gather(name, "text", |column, out: &mut Vec<String>| {
            let own = |v: Option<&str>| v.unwrap_or_default().to_owned();
            match column.data_type() {
                DataType::Utf8 => out.extend(column.as_string::<i32>().iter().map(own)),
                DataType::LargeUtf8 => out.extend(column.as_string::<i64>().iter().map(own)),
                DataType::Utf8View => out.extend(column.as_string_view().iter().map(own)),
                _ => return false,
            }
            true
        })
    }

    /// The values of a column that must not contain nulls.
    fn filled<T>(&self, name: &str, values: Vec<Option<T>>) -> Result<Vec<T>, Error> {
        let filled = |(row, v): (usize, Option<T>)| {
            let what = || format!("column `{name}` is null or out of range");
            v.ok_or_else(|| Error::input(&self.path, format!("row {row}"), what()))
        };
        values.into_iter().enumerate().map(filled).collect()
    }

    /// A column over all batches; `take` returns false for a type it cannot use.
    fn gather<T>(
        &self,
        name: &str,
        kind: &str,
        take: impl Fn(&dyn Array, &mut Vec<T>) -> bool,
    ) -> Result<Vec<T>, Error> {
        let mut out = Vec::new();
        for batch in &self.batches {
            let missing = || Error::input(&self.path, "", format!("has no column `{name}`"));
            let column = batch.column_by_name(name).ok_or_else(missing)?;
            if !take(column.as_ref(), &mut out) {
                let what = format!("column `{name}` is {}, not {kind}", column.data_type());
                return Err(Error::input(&self.path, "", what));
            }
        }
        Ok(out)
    }
}

/// The record batches of a file, with some of its columns.
fn batches(path: &Path, bytes: &[u8], columns: &[&str]) -> Result<Vec<RecordBatch>, Error> {
    let damaged = |e: ArrowError| Error::input(path, "", format!("damaged: {e}"));
    // Once for the schema, once with the columns: others may have types not needed here.
    let all = FileReaderBuilder::new().build(Cursor::new(bytes)).map_err(damaged)?.schema();
    let mut wanted = Vec::with_capacity(columns.len());
    for name in columns {
        let missing = |_| Error::input(path, "", format!("has no column `{name}`"));
        wanted.push(all.index_of(name).map_err(missing)?);
    }
    let reader = FileReaderBuilder::new()
        .with_projection(wanted)
        .build(Cursor::new(bytes))
        .map_err(damaged)?;
    reader.collect::<Result<_, _>>().map_err(damaged)
}

/// Appends the numbers of a column; `None` where a number is null or cannot be a `V`.
fn extend<T, V>(column: &dyn Array, out: &mut Vec<Option<V>>)
where
    T: ArrowPrimitiveType,
    V: TryFrom<T::Native>,
{
    out.extend(column.as_primitive::<T>().iter().map(|v| v?.try_into().ok()));
}
