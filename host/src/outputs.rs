//! The files of a run.
//!
//! | file | rows |
//! |---|---|
//! | `columns/FRAME.feather` | solid columns of a pair's first sweep |
//! | `points/FRAME.feather` | returns of a pair's first sweep |
//! | `tracklets/FRAME.feather` | tracklets at a pair's second sweep |
//! | `png/FRAME.png` | picture of a pair's first sweep |
//! | `argoverse/LOG/TIMESTAMP.feather` | returns of a pair's first sweep, for graders |
//!
//! Besides these, a film, a page and messages ([`raywake_io::sink::bag`]) if asked for.
//!
//! The first three kinds may be replaced by one Parquet file each for all sweeps. Existing feather
//! files are kept: an interrupted run recomputes the same results, and continues.
//!
//! `FRAME` is the sweep's frame number with ten digits, or its timestamp, ns. Every file is either
//! complete or absent.

use std::path::{Path, PathBuf};

use raywake_core::output::PairFlows;
use raywake_core::output::{PointFlow, Status, TrackletState};
use raywake_core::params::Profile;

use crate::args::{Export, PictureFrame, Results};
use crate::console::await_viewer;
use crate::picture::{PictureFiles, Pictures, Subject};
use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::flow_tables::{FlowTables, SweepMark};
use raywake_io::sink::streams::{Content, Pace, StreamTargets};
use raywake_io::sink::{argoverse, atomic};
use raywake_io::source::{Overview, SweepData};

/// Which files are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds {
    /// Tables of columns and tracklets.
    pub columns: bool,
    /// Tables of returns.
    pub points: bool,
    /// One Parquet file for all sweeps of a table.
    pub parquet: bool,
    /// Which velocities pictures show.
    pub frame: PictureFrame,
    /// Submission files of Argoverse 2.
    pub argoverse: bool,
}

/// The files of a run.
#[derive(Clone, Debug, Default)]
pub struct RunFiles {
    /// Folder for everything with a file per sweep.
    pub root: Option<PathBuf>,
    /// Which files are written.
    pub kinds: Kinds,
    /// Messages of all sweeps.
    pub streams: StreamTargets,
    /// Pictures, film and page.
    pub pictures: PictureFiles,
}

impl RunFiles {
    /// What the command line asks for.
    pub fn of(results: &Results) -> RunFiles {
        let root = results.out.clone();
        let png = root.as_ref().filter(|_| results.png.is_some()).map(|root| root.join("png"));
        let (streams, kinds) = (results.streams.sinks(Pace::Recorded), Kinds::of(results));
        RunFiles { root, kinds, streams, pictures: PictureFiles::of(&results.views, png) }
    }

    /// Whether nothing will be written.
    pub fn is_empty(&self) -> bool {
        self.root.is_none() && self.streams.is_empty() && self.pictures.is_empty()
    }
}

/// Where files go.
pub struct Outputs {
    root: Option<PathBuf>,
    kinds: Kinds,
    tables: Option<FlowTables>,
    log: String,
    profile: Profile,
    pictures: Pictures,
    bag: Option<BagSink>,
}

impl Kinds {
    /// What the command line asks for.
    fn of(results: &Results) -> Kinds {
        Kinds {
            columns: true,
            points: !results.no_points,
            parquet: results.parquet,
            frame: results.png.unwrap_or_default(),
            argoverse: results.export == Some(Export::Argoverse),
        }
    }

    /// Creates the folders. Fails if this build lacks a feature that the files need.
    fn tables(&self, root: &Path) -> Result<Option<FlowTables>, Error> {
        if !cfg!(feature = "arrow") && (self.columns || self.points || self.argoverse) {
            return Err(Error::missing_feature("--out", "arrow"));
        }
        if self.parquet && !cfg!(feature = "parquet") {
            return Err(Error::missing_feature("--parquet", "parquet"));
        }
        atomic::create_folder(root)?;
        if self.argoverse {
            atomic::create_folder(&root.join("argoverse"))?;
        }
        Ok(match (self.columns, self.parquet) {
            (false, _) => None,
            (true, true) => Some(FlowTables::files(root)),
            (true, false) => Some(FlowTables::folders(root, self.points)?),
        })
    }
}

impl Outputs {
    /// Creates folders and files for some sweeps of a recording; what is not named is not written.
    pub fn create(
        files: &RunFiles,
        recording: &Overview,
        sweeps: usize,
        profile: &Profile,
    ) -> Result<Outputs, Error> {
        let RunFiles { root, streams, pictures, kinds } = files;
        let tables = root.as_deref().map(|root| kinds.tables(root)).transpose()?.flatten();
        Ok(Outputs {
            root: root.clone(),
            kinds: *kinds,
            tables,
            log: recording.name.to_string(),
            profile: profile.clone(),
            pictures: Pictures::create(pictures, &recording.name, sweeps)?,
            bag: BagSink::create(streams, recording.epoch_ns, Content::Flow)?,
        })
    }

    /// Waits for a viewer, if one is expected.
    pub fn await_viewer(&self, quiet: bool) -> Result<(), Error> {
        await_viewer(quiet, self.bag.as_ref())
    }

    /// Writes the results of a pair of sweeps for its first sweep; `ms` is the time they took.
    pub fn pair(&mut self, first: &SweepData, flows: &PairFlows, ms: f64) -> Result<(), Error> {
        if let Some(bag) = &mut self.bag {
            bag.pair(first, flows)?;
        }
        if self.pictures.are_enabled() {
            let (columns, profile, frame) = (flows.columns, &self.profile, self.kinds.frame);
            let moving = flows.points.iter().filter(|p| p.status == Status::Moving).count();
            let figures = [("moving returns", moving as f64), ("ms per sweep", ms)];
            self.pictures.write(first, &Subject::Flow { columns, profile, frame }, &figures)?;
        }
        let Some(root) = &self.root else { return Ok(()) };
        let rows: Vec<PointFlow> = flows.points.iter().collect();
        if let Some(tables) = &mut self.tables {
            let mark = mark(first, flows.dt_s);
            tables.columns(&mark, flows.columns)?;
            if self.kinds.points {
                tables.points(&mark, &first.points, &rows)?;
            }
        }
        if self.kinds.argoverse {
            let (pose, dt) = (&first.world_from_vehicle, flows.dt_s);
            argoverse::export(&root.join("argoverse"), &self.log, first.frame, &rows, pose, dt)?;
        }
        Ok(())
    }

    /// Completes the files that span all sweeps; the page ends with the summary.
    pub fn finish(self, summary: &str) -> Result<(), Error> {
        self.pictures.finish(summary)?;
        self.tables.map_or(Ok(()), FlowTables::finish)?;
        self.bag.map_or(Ok(()), BagSink::finish)
    }

    /// Writes the tracklets at a pair's second sweep, `dt_s` after its first.
    pub fn tracklets(
        &mut self,
        second: &SweepData,
        tracklets: &[TrackletState],
        dt_s: f64,
    ) -> Result<(), Error> {
        let Some(tables) = &mut self.tables else { return Ok(()) };
        tables.tracklets(&mark(second, dt_s), tracklets)
    }
}

fn mark(sweep: &SweepData, dt_s: f64) -> SweepMark {
    SweepMark { frame: sweep.frame, stamp_s: sweep.stamp_s, dt_s }
}
