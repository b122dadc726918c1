//! The files written by tracking.

use std::path::PathBuf;

use raywake_core::encoder::ColumnClass;
use raywake_objects::front_end::{StateVariances, Track};
use raywake_objects::object_box::ObjectBox;
use raywake_objects::tracked::TrackedObject;
use raywake_objects::{ObjectReturn, ObjectState};

use super::{Ended, Tracker};
use crate::args::TrackArgs;
use crate::console::await_viewer;
use crate::picture::{PictureFiles, Pictures, Subject};
use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::streams::{Content, Pace};
use raywake_io::sink::table::TableWriter;
use raywake_io::sink::{atomic, clouds, feather};
use raywake_io::source::{Overview, SweepData};

/// Where files go, and the rows of `tracks.feather`.
pub struct Files {
    folder: Option<PathBuf>,
    pictures: Pictures,
    bag: Option<BagSink>,
    rows: Vec<TrackRow>,
    /// Track number of every return of a sweep, -1 without one.
    of_returns: Vec<i32>,
}

/// A track at one of its updates: times of the recording, s, and positions in the world, m.
struct TrackRow {
    track: u32,
    filter: ObjectState,
    estimate: ObjectState,
    /// NaN if there is none.
    lag: ObjectState,
    /// The box in the frame of the estimate.
    shape: ObjectBox,
    variances: StateVariances,
    p_moves: f32,
    class: u8,
}

const NONE: ObjectState = ObjectState {
    time_s: f64::NAN,
    position: [f64::NAN; 3],
    heading: f64::NAN,
    speed: f64::NAN,
    climb: f64::NAN,
    turn_rate: f64::NAN,
};

impl Files {
    /// Creates folders and files for some sweeps of a recording, and waits for a viewer, if one is
    /// expected; what is not named is not written.
    pub fn create(args: &TrackArgs, of: &Overview, sweeps: usize) -> Result<Files, Error> {
        let folder = args.out.clone();
        if let Some(root) = &folder {
            if !cfg!(feature = "arrow") {
                return Err(Error::missing_feature("--out", "arrow"));
            }
            ["clouds", "returns"].iter().try_for_each(|n| atomic::create_folder(&root.join(n)))?;
        }
        let png = folder.as_ref().filter(|_| args.png).map(|out| out.join("png"));
        let pictures = Pictures::create(&PictureFiles::of(&args.views, png), &of.name, sweeps)?;
        let bag =
            BagSink::create(&args.streams.sinks(Pace::Recorded), of.epoch_ns, Content::Objects)?;
        await_viewer(args.quiet, bag.as_ref())?;
        Ok(Files { folder, pictures, bag, rows: Vec::new(), of_returns: Vec::new() })
    }

    /// Writes the sweep of the last step, which took `ms` milliseconds.
    pub fn sweep(&mut self, sweep: &SweepData, tracker: &Tracker, ms: f64) -> Result<(), Error> {
        if self.folder.is_none() && self.bag.is_none() && !self.pictures.are_enabled() {
            return Ok(());
        }
        self.of_returns.clear();
        self.of_returns.resize(sweep.points.len(), -1);
        tracker.members().for_each(|(n, track)| self.of_returns[n] = track as i32);
        let (objects, paths): (Vec<TrackedObject>, Vec<Vec<[f64; 3]>>) =
            tracker.objects().map(|(object, track)| (object, track_path(track))).unzip();
        let moving = objects.iter().filter(|o| o.velocity.is_some()).count();
        let figures = [("moving objects", moving as f64), ("ms per sweep", ms)];
        self.pictures.write(
            sweep,
            &Subject::Objects { objects: &objects, paths: &paths },
            &figures,
        )?;
        if let Some(bag) = &mut self.bag {
            bag.objects(sweep, &self.of_returns, &objects)?;
        }
        let Some(folder) = &self.folder else { return Ok(()) };
        let mut t = TableWriter::default();
        t.column("track", &self.of_returns, |track| *track);
        t.write(&folder.join(format!("returns/{:010}.feather", sweep.frame)), &[])
    }

    /// Writes the cloud of an ended track, and keeps its rows for later.
    pub fn track(&mut self, ended: &Ended) -> Result<(), Error> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let Ended { track, estimator, shape, .. } = ended;
        let placed = |state: ObjectState| ObjectState {
            time_s: track.start_s + state.time_s,
            position: [0, 1, 2].map(|a| track.anchor[a] + state.position[a]),
            ..state
        };
        let lag = |n: usize| ended.lag.and_then(|states| states.get(n)).copied().unwrap_or(NONE);
        self.rows.extend(track.history().iter().enumerate().map(|(n, filter)| TrackRow {
            track: track.id,
            filter: placed(*filter),
            estimate: placed(estimator.state(filter.time_s)),
            lag: placed(lag(n)),
            shape: *shape,
            variances: track.variances().get(n).copied().unwrap_or_default(),
            p_moves: track.p_moves().get(n).copied().unwrap_or(f32::NAN),
            class: ColumnClass::number(track.class()),
        }));
        let in_frame = |seen: &ObjectReturn| {
            let place = estimator.state(f64::from(seen.time_s)).local(seen.position);
            [place[0], place[1], place[2], seen.time_s]
        };
        let rows: Vec<[f32; 4]> = track.returns().iter().map(in_frame).collect();
        let path = folder.join(format!("clouds/{:05}.ply", track.id));
        clouds::write_ply(&path, ["x", "y", "z", "time"], &rows)
    }

    /// Completes the files after all tracks; the page ends with the summary.
    pub fn finish(self, summary: &str) -> Result<(), Error> {
        self.pictures.finish(summary)?;
        self.bag.map_or(Ok(()), BagSink::finish)?;
        let Some(folder) = &self.folder else { return Ok(()) };
        let mut t = TableWriter::default();
        t.column("track", &self.rows, |r| r.track);
        t.column("time_s", &self.rows, |r| r.filter.time_s);
        let mut states = |prefix: &str, of: fn(&TrackRow) -> &ObjectState| {
            let mut add = |name: &str, value: fn(&ObjectState) -> f64| {
                t.column(&format!("{prefix}{name}"), &self.rows, |r| value(of(r)));
            };
            add("x_m", |s| s.position[0]);
            add("y_m", |s| s.position[1]);
            add("z_m", |s| s.position[2]);
            add("heading_rad", |s| s.heading);
            add("speed_mps", |s| s.speed);
            add("climb_mps", |s| s.climb);
            add("turn_rate_radps", |s| s.turn_rate);
        };
        states("ekf_", |r| &r.filter);
        states("", |r| &r.estimate);
        states("lag_", |r| &r.lag);
        t.column("lag_time_s", &self.rows, |r| r.lag.time_s);
        objects(&mut t, &self.rows);
        t.write(&folder.join("tracks.feather"), &[feather::class_names()])
    }
}

/// The path of a track in the world, m.
fn track_path(track: &Track) -> Vec<[f64; 3]> {
    track.history().iter().map(|state| track.in_world(state.position)).collect()
}

/// Adds the columns that describe a track besides its states.
fn objects(t: &mut TableWriter, rows: &[TrackRow]) {
    t.array(["cov_xx", "cov_xy", "cov_yy", "cov_zz"], rows, |r| r.variances.position);
    t.column("cov_speed", rows, |r| r.variances.speed);
    t.column("cov_heading", rows, |r| r.variances.heading);
    t.array(["box_x_m", "box_y_m", "box_z_m"], rows, |r| r.estimate.placed(r.shape.centre));
    t.column("box_heading_rad", rows, |r| r.estimate.heading + f64::from(r.shape.turn));
    t.array(["length_m", "width_m", "height_m"], rows, |r| r.shape.size);
    t.column("p_moves", rows, |r| r.p_moves);
    t.column("class", rows, |r| r.class);
}
