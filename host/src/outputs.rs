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
//! `FRAME` is the sweep's frame number with ten digits, or its timestamp, ns. Every file is whole
//! or absent.

use std::path::{Path, PathBuf};

use raywake_core::output::PairFlows;
use raywake_core::output::{PointFlow, TrackletState};
use raywake_core::params::Profile;

use crate::args::{Export, PictureFrame, Results};
use crate::picture::{Pictures, Subject};
use raywake_io::Error;
use raywake_io::sink::{argoverse, atomic, feather};
use raywake_io::source::SweepData;

/// Which files are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds {
    /// Feather files of columns and tracklets.
    pub columns: bool,
    /// Feather files of returns.
    pub points: bool,
    /// Pictures.
    pub png: Option<PictureFrame>,
    /// Submission files of Argoverse 2.
    pub argoverse: bool,
}

/// Where files go.
pub struct Outputs {
    folders: Option<Folders>,
    log: String,
    profile: Profile,
    pictures: Option<(Pictures, PictureFrame)>,
}

struct Folders {
    columns: Option<PathBuf>,
    tracklets: Option<PathBuf>,
    points: Option<PathBuf>,
    argoverse: Option<PathBuf>,
}

impl Kinds {
    /// What the command line asks for.
    pub fn of(results: &Results) -> Kinds {
        Kinds {
            columns: true,
            points: !results.no_points,
            png: results.png,
            argoverse: results.export == Some(Export::Argoverse),
        }
    }

    /// Fails where this build lacks a feature that the files need.
    fn check(&self) -> Result<(), Error> {
        if !cfg!(feature = "arrow") && (self.columns || self.points || self.argoverse) {
            let what = "--out needs the feature `arrow`, which is not compiled in";
            return Err(Error::Unsupported(what.into()));
        }
        Ok(())
    }
}

impl Outputs {
    /// Creates the folders for the recording named `log` under `root`; without one nothing will be
    /// written.
    pub fn create(
        root: Option<&Path>,
        kinds: Kinds,
        log: &str,
        profile: &Profile,
    ) -> Result<Outputs, Error> {
        let folders = root.map(|root| Folders::create(root, kinds)).transpose()?;
        let pictures = match root.zip(kinds.png) {
            Some((root, frame)) => Some((Pictures::folder(&root.join("png"), log)?, frame)),
            None => None,
        };
        Ok(Outputs { folders, log: log.to_string(), profile: profile.clone(), pictures })
    }

    /// Writes what a pair of sweeps yields for its first sweep.
    pub fn pair(&mut self, first: &SweepData, flows: &PairFlows) -> Result<(), Error> {
        let Some(folders) = &self.folders else { return Ok(()) };
        let meta = meta(first, flows.dt_s);
        if let Some(folder) = &folders.columns {
            feather::write_columns(&named(folder, first, "feather"), flows.columns, &meta)?;
        }
        if let Some(folder) = &folders.points {
            // The pipeline has no flow for returns over its capacity.
            let points = &first.points[..flows.points.len().min(first.points.len())];
            feather::write_points(&named(folder, first, "feather"), points, flows.points, &meta)?;
        }
        if let Some((pictures, frame)) = &mut self.pictures {
            let (columns, profile, frame) = (flows.columns, &self.profile, *frame);
            pictures.write(first, &Subject::Flow { columns, profile, frame })?;
        }
        if let Some(folder) = &folders.argoverse {
            let (pose, dt) = (&first.world_from_vehicle, flows.dt_s);
            // Graders want a row for every return, those over the capacity too.
            let mut rows = flows.points.to_vec();
            rows.resize(first.points.len().max(rows.len()), PointFlow::default());
            argoverse::export(folder, &self.log, first.frame, &rows, pose, dt)?;
        }
        Ok(())
    }

    /// Writes the tracklets at a pair's second sweep, `dt_s` after its first.
    pub fn tracklets(
        &self,
        second: &SweepData,
        tracklets: &[TrackletState],
        dt_s: f64,
    ) -> Result<(), Error> {
        match self.folders.as_ref().and_then(|f| f.tracklets.as_ref()) {
            Some(folder) => {
                let path = named(folder, second, "feather");
                feather::write_tracklets(&path, tracklets, &meta(second, dt_s))
            }
            None => Ok(()),
        }
    }
}

impl Folders {
    fn create(root: &Path, kinds: Kinds) -> Result<Folders, Error> {
        kinds.check()?;
        atomic::create_folder(root)?;
        let folder = |name: &str, wanted: bool| {
            let path = root.join(name);
            wanted.then(|| atomic::create_folder(&path).map(|()| path)).transpose()
        };
        Ok(Folders {
            columns: folder("columns", kinds.columns)?,
            tracklets: folder("tracklets", kinds.columns)?,
            points: folder("points", kinds.points)?,
            argoverse: folder("argoverse", kinds.argoverse)?,
        })
    }
}

/// A sweep's file. Ten digits, so that names sort as frames do.
fn named(folder: &Path, sweep: &SweepData, extension: &str) -> PathBuf {
    folder.join(format!("{:010}.{extension}", sweep.frame))
}

fn meta(sweep: &SweepData, dt_s: f64) -> [(&'static str, String); 3] {
    [
        ("frame", sweep.frame.to_string()),
        ("stamp_s", sweep.stamp_s.to_string()),
        ("dt_s", dt_s.to_string()),
    ]
}
