//! What is kept of an object from its birth to its end.

use super::batch::Seen;
use crate::centroid_ekf::{CentroidEkf, CentroidParams};
use crate::{ObjectReturn, ObjectState, RETURNS_MAX};

/// States of the filter that a track keeps.
pub const HISTORY_MAX: usize = 512;
/// Returns of its last batch that a track keeps.
pub const LATEST_MAX: usize = 256;

/// Every k-th of a sequence, with k doubled whenever there is no room for more.
#[derive(Clone, Debug)]
pub struct Thinned<T, const N: usize> {
    kept: heapless::Vec<T, N>,
    every: u64,
    seen: u64,
}

impl<T: Copy, const N: usize> Thinned<T, N> {
    /// Nothing yet.
    pub const fn new() -> Thinned<T, N> {
        // What is kept stays at even multiples when every other one goes.
        assert!(N >= 2 && N.is_multiple_of(2));
        Thinned { kept: heapless::Vec::new(), every: 0, seen: 0 }
    }

    /// The next one.
    pub fn push(&mut self, item: T) {
        if self.seen.is_multiple_of(self.every()) {
            if self.kept.is_full() {
                for n in 0..N / 2 {
                    self.kept[n] = self.kept[2 * n];
                }
                self.kept.truncate(N / 2);
                self.every = 2 * self.every();
            }
            // There is room.
            let _ = self.kept.push(item);
        }
        self.seen += 1;
    }

    /// Those kept, in their order.
    pub fn kept(&self) -> &[T] {
        &self.kept
    }

    /// Of how many one is kept.
    pub fn every(&self) -> u64 {
        self.every.max(1)
    }

    /// How many there were.
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// As if there had been none.
    pub fn clear(&mut self) {
        self.kept.clear();
        (self.every, self.seen) = (0, 0);
    }
}

impl<T: Copy, const N: usize> Default for Thinned<T, N> {
    fn default() -> Self {
        Thinned::new()
    }
}

/// Where a track is in its life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Life {
    /// Room for one.
    #[default]
    Free,
    /// It is followed.
    Live,
    /// It has ended; its room is free from the next step on.
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

    /// Of how many updates the history holds one.
    pub fn history_every(&self) -> u64 {
        self.history.every()
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
        revision.revise(&state, &mut self.history.kept);
        self.history.push(state);
        self.latest.clear();
        self.observations += 1;
    }

    /// Keeps a return that lies and began at places in the world.
    pub(super) fn keep(&mut self, time_s: f64, at: [f64; 3], origin: [f64; 3], seen: &Seen) {
        let place = |at| self.place(at).map(|v| v as f32);
        let seen = ObjectReturn {
            position: place(at),
            origin: place(origin),
            time_s: (time_s - self.start_s) as f32,
            sensor: seen.sensor,
            passed: seen.passed,
        };
        self.returns.push(seen);
        self.latest.push(seen);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_kth_is_kept() {
        for count in [0, 1, 8, 9, 16, 17, 33, 1000] {
            let mut thinned = Thinned::<usize, 8>::new();
            (0..count).for_each(|n| thinned.push(n));
            let every = thinned.every() as usize;
            let wanted: Vec<usize> = (0..count).step_by(every).collect();
            assert_eq!(thinned.kept(), wanted, "{count}");
            assert_eq!(thinned.seen(), count as u64);
            assert!(every == 1 || wanted.len() > 4, "{count}: one of {every}");
        }
    }
}
