//! The rows of a drive as a Parquet file.

use super::row::{Row, batch, rows, schema};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;
use raywake_io::Error;
use raywake_io::sink::atomic;
use std::fs::File;
use std::io;
use std::path::Path;

/// Writes the rows that `next` returns, pair by pair, until there are no more; the file exists only
/// once all rows are in it.
pub fn write(
    path: &Path,
    drive: &str,
    mut next: impl FnMut() -> Result<Option<Vec<Row>>, Error>,
) -> Result<(), Error> {
    let mut failed = None;
    let written = atomic::write(path, |out| {
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut writer = ArrowWriter::try_new(out, schema(), Some(properties))?;
        loop {
            match next() {
                Ok(Some(rows)) => writer.write(&batch(drive, &rows))?,
                Ok(None) => break,
                Err(e) => {
                    failed = Some(e);
                    return Err(io::Error::other("no more rows"));
                }
            }
        }
        writer.close()?;
        Ok(())
    });
    failed.map_or(written, Err)
}

/// Passes the rows of a file to `each`, in batches. Fails if the file is damaged or lacks a column.
pub fn read(path: &Path, mut each: impl FnMut(&[Row])) -> Result<(), Error> {
    let broken = |e: &dyn std::fmt::Display| Error::input(path, "", e.to_string());
    let file = File::open(path).map_err(|e| broken(&e))?;
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| broken(&e))?;
    for batch in builder.with_batch_size(1 << 16).build().map_err(|e| broken(&e))? {
        let batch = batch.map_err(|e| broken(&e))?;
        let rows = rows(&batch)
            .map_err(|column| Error::input(path, format!("column `{column}`"), "is missing"))?;
        if let Some(row) = rows.iter().find(|r| !r.is_valid()) {
            let what = format!("class {}, motion {}: unknown", row.class, row.motion);
            return Err(Error::input(path, format!("sweep {}", row.sweep), what));
        }
        each(&rows);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    #[test]
    fn written_and_read() {
        let scratch = Scratch::new();
        let path = scratch.path().join("rows.parquet");
        let row = |n: u32| Row { sweep: n, flow_x: n as f32, ..Row::default() };
        let mut batches = vec![vec![row(1), row(2)], vec![], vec![row(3)]].into_iter();
        write(&path, "a", || Ok(batches.next())).unwrap();
        let mut back = Vec::new();
        read(&path, |rows| back.extend_from_slice(rows)).unwrap();
        assert_eq!(back, [row(1), row(2), row(3)]);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        assert!(read(&path, |_| ()).unwrap_err().to_string().contains("rows.parquet"));
    }

    #[test]
    fn classes_that_do_not_exist_are_refused() {
        let scratch = Scratch::new();
        let path = scratch.path().join("rows.parquet");
        let mut batches = vec![vec![Row { motion: 3, ..Row::default() }]].into_iter();
        write(&path, "a", || Ok(batches.next())).unwrap();
        assert!(read(&path, |_| ()).unwrap_err().to_string().contains("motion 3"));
    }

    #[test]
    fn a_failure_leaves_no_file() {
        let scratch = Scratch::new();
        let path = scratch.path().join("none.parquet");
        let failed = write(&path, "a", || Err(Error::Usage("why".into())));
        assert!(failed.unwrap_err().to_string().contains("why"));
        assert!(!path.exists());
    }
}
