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
//! Beside them an MCAP file where one is named, see [`raywake_io::sink::bag`].
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
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::{argoverse, atomic, feather};
use raywake_io::source::{Overview, SweepData};

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
    root: Option<PathBuf>,
    kinds: Kinds,
    log: String,
    profile: Profile,
    pictures: Option<(Pictures, PictureFrame)>,
    bag: Option<BagSink>,
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

    /// Creates the folders. Fails where this build lacks a feature that the files need.
    fn create_folders(&self, root: &Path) -> Result<(), Error> {
        if !cfg!(feature = "arrow") && (self.columns || self.points || self.argoverse) {
            let what = "--out needs the feature `arrow`, which is not compiled in";
            return Err(Error::Unsupported(what.into()));
        }
        atomic::create_folder(root)?;
        let (columns, points) = (self.columns, self.points);
        let all = [("columns", columns), ("tracklets", columns), ("points", points)];
        let all = all.into_iter().chain([("argoverse", self.argoverse)]);
        all.filter(|f| f.1).try_for_each(|(name, _)| atomic::create_folder(&root.join(name)))
    }
}

impl Outputs {
    /// Creates the folders for a recording under `root`, and its MCAP file; without either nothing
    /// will be written.
    pub fn create(
        root: Option<&Path>,
        mcap: Option<&Path>,
        kinds: Kinds,
        recording: &Overview,
        profile: &Profile,
    ) -> Result<Outputs, Error> {
        let log = &recording.name;
        root.map_or(Ok(()), |root| kinds.create_folders(root))?;
        let pictures = match root.zip(kinds.png) {
            Some((root, frame)) => Some((Pictures::folder(&root.join("png"), log)?, frame)),
            None => None,
        };
        let (log, profile) = (log.to_string(), profile.clone());
        let bag = mcap.map(|path| BagSink::create(path, recording.epoch_ns)).transpose()?;
        Ok(Outputs { root: root.map(Path::to_path_buf), kinds, log, profile, pictures, bag })
    }

    /// Writes what a pair of sweeps yields for its first sweep.
    pub fn pair(&mut self, first: &SweepData, flows: &PairFlows) -> Result<(), Error> {
        if let Some(bag) = &mut self.bag {
            bag.pair(first, flows)?;
        }
        let Some(root) = &self.root else { return Ok(()) };
        let meta = meta(first, flows.dt_s);
        if self.kinds.columns {
            feather::write_columns(&named(root, "columns", first), flows.columns, &meta)?;
        }
        if self.kinds.points {
            let of_points: Vec<PointFlow> = flows.points.iter().collect();
            let path = named(root, "points", first);
            feather::write_points(&path, &first.points, &of_points, &meta)?;
        }
        if let Some((pictures, frame)) = &mut self.pictures {
            let (columns, profile, frame) = (flows.columns, &self.profile, *frame);
            pictures.write(first, &Subject::Flow { columns, profile, frame })?;
        }
        if self.kinds.argoverse {
            let (pose, dt) = (&first.world_from_vehicle, flows.dt_s);
            let rows: Vec<PointFlow> = flows.points.iter().collect();
            argoverse::export(&root.join("argoverse"), &self.log, first.frame, &rows, pose, dt)?;
        }
        Ok(())
    }

    /// Completes the file that all sweeps go to.
    pub fn finish(self) -> Result<(), Error> {
        self.bag.map_or(Ok(()), BagSink::finish)
    }

    /// Writes the tracklets at a pair's second sweep, `dt_s` after its first.
    pub fn tracklets(
        &self,
        second: &SweepData,
        tracklets: &[TrackletState],
        dt_s: f64,
    ) -> Result<(), Error> {
        match &self.root {
            Some(root) if self.kinds.columns => {
                let path = named(root, "tracklets", second);
                feather::write_tracklets(&path, tracklets, &meta(second, dt_s))
            }
            _ => Ok(()),
        }
    }
}

/// A sweep's file. Ten digits, so that names sort as frames do.
fn named(root: &Path, kind: &str, sweep: &SweepData) -> PathBuf {
    root.join(format!("{kind}/{:010}.feather", sweep.frame))
}

fn meta(sweep: &SweepData, dt_s: f64) -> [(&'static str, String); 3] {
    [
        ("frame", sweep.frame.to_string()),
        ("stamp_s", sweep.stamp_s.to_string()),
        ("dt_s", dt_s.to_string()),
    ]
}
