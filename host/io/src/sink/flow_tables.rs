//! The tables of a run's flow: a feather file per sweep, or a Parquet file for all.

use std::path::{Path, PathBuf};

use raywake_core::output::{ColumnFlow, PointFlow, TrackletState};
use raywake_core::sweep::Point;

use super::feather::{self, class_names, status_names};
use super::parquet::ParquetFile;
use super::table::TableWriter;
use super::{Meta, atomic};
use crate::Error;
use crate::source::whole;

/// The sweep that rows belong to.
#[derive(Clone, Copy, Debug)]
pub struct SweepMark {
    /// Its frame number or timestamp.
    pub frame: u64,
    /// Its time, s.
    pub stamp_s: f64,
    /// From the first sweep of its pair to the second, s.
    pub dt_s: f64,
}

/// Kinds of tables: names of folders and files.
const KINDS: [&str; 3] = ["columns", "points", "tracklets"];
const COLUMNS: usize = 0;
const POINTS: usize = 1;
const TRACKLETS: usize = 2;

/// Where tables go.
pub enum FlowTables {
    /// A folder for each kind under a root, with a file `FRAME.feather` per sweep.
    Folders(Folders),
    /// One file of each kind.
    Files(Box<[ParquetFile; KINDS.len()]>),
}

/// Tables of single sweeps. Existing ones, as left by an interrupted run, must be identical to
/// those that would be written.
pub struct Folders {
    root: PathBuf,
}

impl FlowTables {
    /// Creates folders for all kinds, except that of returns if it is not wanted.
    pub fn folders(root: &Path, with_points: bool) -> Result<FlowTables, Error> {
        let kinds = KINDS.iter().enumerate().filter(|(n, _)| with_points || *n != POINTS);
        kinds.map(|(_, name)| root.join(name)).try_for_each(|f| atomic::create_folder(&f))?;
        Ok(FlowTables::Folders(Folders { root: root.to_path_buf() }))
    }

    /// One file of each kind, [`KINDS`] with `.parquet`. Rows begin with `frame` uint64, `stamp_s`
    /// and `dt_s` float64.
    pub fn files(root: &Path) -> FlowTables {
        let file = |name| ParquetFile::new(&root.join(format!("{name}.parquet")));
        FlowTables::Files(Box::new(KINDS.map(file)))
    }

    /// Writes the flow of columns, as [`feather::columns`] describes it.
    pub fn columns(&mut self, of: &SweepMark, rows: &[ColumnFlow]) -> Result<(), Error> {
        self.write(COLUMNS, of, rows.len(), feather::columns(rows), &[class_names()])
    }

    /// Writes the flow of returns: [`feather::points`], or in a single file
    /// [`feather::points_in_short`].
    pub fn points(
        &mut self,
        of: &SweepMark,
        points: &[Point],
        flows: &[PointFlow],
    ) -> Result<(), Error> {
        let table = match self {
            FlowTables::Folders(_) => feather::points(points, flows),
            FlowTables::Files(_) => feather::points_in_short(points, flows),
        };
        self.write(POINTS, of, points.len(), table, &[status_names(), class_names()])
    }

    /// Writes tracklets, as [`feather::tracklets`] describes them.
    pub fn tracklets(&mut self, of: &SweepMark, rows: &[TrackletState]) -> Result<(), Error> {
        self.write(TRACKLETS, of, rows.len(), feather::tracklets(rows), &[])
    }

    fn write(
        &mut self,
        kind: usize,
        of: &SweepMark,
        rows: usize,
        table: TableWriter,
        meta: Meta<'_>,
    ) -> Result<(), Error> {
        match self {
            FlowTables::Folders(folders) => folders.write(kind, of, table, meta),
            FlowTables::Files(files) => {
                let rows = vec![(); rows];
                let mut whole = TableWriter::default();
                whole.column("frame", &rows, |()| of.frame);
                whole.column("stamp_s", &rows, |()| of.stamp_s);
                whole.column("dt_s", &rows, |()| of.dt_s);
                files[kind].append(whole.beside(table), meta)
            }
        }
    }

    /// Completes the files.
    pub fn finish(self) -> Result<(), Error> {
        match self {
            FlowTables::Folders(_) => Ok(()),
            FlowTables::Files(files) => files.into_iter().try_for_each(ParquetFile::finish),
        }
    }
}

impl Folders {
    fn write(
        &mut self,
        kind: usize,
        of: &SweepMark,
        table: TableWriter,
        meta: Meta<'_>,
    ) -> Result<(), Error> {
        // Ten digits, so that names sort in frame order.
        let path = self.root.join(format!("{}/{:010}.feather", KINDS[kind], of.frame));
        let mark = [
            ("frame", of.frame.to_string()),
            ("stamp_s", of.stamp_s.to_string()),
            ("dt_s", of.dt_s.to_string()),
        ];
        let bytes = table.file(&path, &[&mark, meta].concat())?;
        if !path.is_file() {
            return atomic::write(&path, |out| std::io::Write::write_all(out, &bytes));
        }
        if whole::read(&path)? != bytes {
            let what = "differs from this run's result: choose another folder, or delete it";
            return Err(Error::Usage(format!("{} {what}", path.display())));
        }
        Ok(())
    }
}
