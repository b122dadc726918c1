//! The files of tracks.

use std::path::{Path, PathBuf};

use raywake_objects::{ObjectReturn, ObjectState};

use super::Ended;
use raywake_io::Error;
use raywake_io::sink::table::TableWriter;
use raywake_io::sink::{atomic, clouds};

/// Where files go, and the rows of `tracks.feather`.
pub struct Files {
    folder: Option<PathBuf>,
    rows: Vec<TrackRow>,
}

/// A track at the time of one of its updates: times of the recording, s, and positions in the
/// world, m.
struct TrackRow {
    track: u32,
    filter: ObjectState,
    estimate: ObjectState,
    /// NaN where there is none.
    lag: ObjectState,
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
    /// Creates the folders; without one nothing will be written.
    pub fn create(root: Option<&Path>) -> Result<Files, Error> {
        if let Some(root) = root {
            if !cfg!(feature = "arrow") {
                let what = "--out needs the feature `arrow`, which is not compiled in";
                return Err(Error::Unsupported(what.into()));
            }
            atomic::create_folder(&root.join("clouds"))?;
        }
        Ok(Files { folder: root.map(Path::to_path_buf), rows: Vec::new() })
    }

    /// A track at its end: its cloud, and its rows for later.
    pub fn track(&mut self, ended: &Ended) -> Result<(), Error> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let Ended { track, estimator, .. } = ended;
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
        }));
        let in_frame = |seen: &ObjectReturn| {
            let place = estimator.state(f64::from(seen.time_s)).local(seen.position);
            [place[0], place[1], place[2], seen.time_s]
        };
        let rows: Vec<[f32; 4]> = track.returns().iter().map(in_frame).collect();
        let path = folder.join(format!("clouds/{:05}.ply", track.id));
        clouds::write_ply(&path, ["x", "y", "z", "time"], &rows)
    }

    /// All tracks have been seen.
    pub fn finish(self) -> Result<(), Error> {
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
        t.write(&folder.join("tracks.feather"), &[])
    }
}
