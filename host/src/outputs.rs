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

use raywake_core::output::{PointFlow, TrackletState};
use raywake_core::params::Profile;
use raywake_core::pipeline::Flows;

use crate::args::{Export, PictureFrame, Results};
#[cfg(feature = "png")]
use crate::picture;
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
    /// Stamp of the first pair, s.
    start_s: Option<f64>,
}

struct Folders {
    columns: Option<PathBuf>,
    tracklets: Option<PathBuf>,
    points: Option<PathBuf>,
    png: Option<(PathBuf, PictureFrame)>,
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
        let needs = [
            (self.columns || self.points || self.argoverse, cfg!(feature = "arrow"), "arrow"),
            (self.png.is_some(), cfg!(feature = "png"), "png"),
        ];
        match needs.iter().find(|(wanted, there, _)| *wanted && !there) {
            Some((_, _, name)) => Err(Error::Unsupported(format!(
                "--out needs the feature `{name}`, which is not compiled in"
            ))),
            None => Ok(()),
        }
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
        Ok(Outputs { folders, log: log.to_string(), profile: profile.clone(), start_s: None })
    }

    /// Writes what a pair of sweeps yields for its first sweep.
    pub fn pair(&mut self, first: &SweepData, flows: &Flows) -> Result<(), Error> {
        let Some(folders) = &self.folders else { return Ok(()) };
        let start_s = *self.start_s.get_or_insert(first.stamp_s);
        let meta = meta(first, flows.dt_s);
        if let Some(folder) = &folders.columns {
            feather::write_columns(&named(folder, first, "feather"), flows.columns, &meta)?;
        }
        if let Some(folder) = &folders.points {
            // The pipeline has no flow for returns over its capacity.
            let points = &first.points[..flows.points.len().min(first.points.len())];
            feather::write_points(&named(folder, first, "feather"), points, flows.points, &meta)?;
        }
        #[cfg(feature = "png")]
        if let Some((folder, frame)) = &folders.png {
            let scene = picture::FlowScene {
                title: self.log.clone(),
                note: picture::note(first, start_s),
                points: &first.points,
                columns: flows.columns,
                world_from_vehicle: first.world_from_vehicle,
                profile: &self.profile,
                frame: *frame,
            };
            picture::flow(&named(folder, first, "png"), &scene)?;
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
            png: folder("png", kinds.png.is_some())?.zip(kinds.png),
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
