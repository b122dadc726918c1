//! A track: an object from its birth to its end.
//!
//! Tracks live in a slice of the caller's, who thus chooses their number where their memory is. A
//! track of any length fits: of its returns and states it keeps every k-th, and k doubles when
//! there is no more room ([`Thinned`]).

use super::batch::BatchReturn;
use super::thinned::Thinned;
use crate::centroid_ekf::{CentroidEkf, CentroidParams};
use crate::{ObjectReturn, ObjectState, RETURNS_MAX};

/// States of the filter that a track keeps.
pub const HISTORY_MAX: usize = 512;
/// Returns of its last batch that a track keeps.
pub const LATEST_MAX: usize = 256;

/// Where a track is in its life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Life {
    /// Room for one.
    #[default]
    Free,
    /// Tracked.
    Live,
    /// Ended; its room is free from the next step on.
    Ended,
}

/// An object followed over time.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Number among all tracks, from 0 in the order of their births.
    pub id: u32,
    /// Where it is in its life.
    pub life: Life,
    /// Place in the world from which its positions count, m: its first centroid.
    pub anchor: [f64; 3],
    /// Time of its first centroid, s.
    pub start_s: f64,
    /// Centroids observed.
    pub observations: u32,
    pub(super) ekf: Option<CentroidEkf>,
    history: Thinned<ObjectState, HISTORY_MAX>,
    returns: Thinned<ObjectReturn, RETURNS_MAX>,
    latest: Thinned<ObjectReturn, LATEST_MAX>,
}

impl Track {
    /// Room for a track.
    pub const fn new() -> Track {
        Track {
            id: 0,
            life: Life::Free,
            anchor: [0.0; 3],
            start_s: 0.0,
            observations: 0,
            ekf: None,
            history: Thinned::new(),
            returns: Thinned::new(),
            latest: Thinned::new(),
        }
    }

    /// States after its updates, as the filter had them in the end: heading and speed before it
    /// knew the one or the other are those it learned.
    pub fn history(&self) -> &[ObjectState] {
        self.history.kept()
    }

    /// Its returns, batch by batch, in the order of their sweeps.
    pub fn returns(&self) -> &[ObjectReturn] {
        self.returns.kept()
    }

    /// Those of its last observation.
    pub fn latest(&self) -> &[ObjectReturn] {
        self.latest.kept()
    }

    /// Returns seen in all.
    pub fn returns_seen(&self) -> u64 {
        self.returns.seen()
    }

    /// The filter's state, unless there is room only.
    pub fn state(&self) -> Option<ObjectState> {
        self.ekf.as_ref().map(CentroidEkf::state)
    }

    /// Time of the filter's last update, s.
    pub fn last_s(&self) -> f64 {
        self.start_s + self.ekf.as_ref().map_or(0.0, CentroidEkf::time_s)
    }

    pub(super) fn free(&mut self) {
        self.life = Life::Free;
        self.ekf = None;
        self.observations = 0;
        self.history.clear();
        self.returns.clear();
        self.latest.clear();
    }

    /// Begins a track at a place in the world.
    pub(super) fn begin(&mut self, id: u32, params: &CentroidParams, time_s: f64, at: [f64; 3]) {
        self.free();
        (self.id, self.life) = (id, Life::Live);
        (self.anchor, self.start_s) = (at, time_s);
        let ekf = CentroidEkf::birth(params, 0.0, [0.0; 3]);
        self.history.push(ekf.state());
        self.ekf = Some(ekf);
        self.observations = 1;
    }

    /// A place in the world, from the anchor.
    pub(super) fn place(&self, at: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|a| at[a] - self.anchor[a])
    }

    /// Observes a centroid in the world.
    pub(super) fn observe(&mut self, params: &CentroidParams, time_s: f64, at: [f64; 3]) {
        let place = self.place(at);
        let Some(ekf) = &mut self.ekf else { return };
        ekf.predict(params, time_s - self.start_s);
        let revision = ekf.update(params, place);
        let state = ekf.state();
        revision.revise(&state, self.history.kept_mut());
        self.history.push(state);
        self.latest.clear();
        self.observations += 1;
    }

    /// Keeps a return that lies and began at places in the world.
    pub(super) fn keep(&mut self, time_s: f64, at: [f64; 3], origin: [f64; 3], one: &BatchReturn) {
        let place = |at| self.place(at).map(|v| v as f32);
        let one = ObjectReturn {
            position: place(at),
            origin: place(origin),
            time_s: (time_s - self.start_s) as f32,
            sensor: one.sensor,
            passed: one.passed,
        };
        self.returns.push(one);
        self.latest.push(one);
    }
}
