//! A track: an object from its birth to its end.
//!
//! Tracks live in a slice of the caller's, who thus chooses their number and where their memory is.
//! A track of any length fits: it keeps every k-th of its returns and states, and k doubles when
//! there is no more room ([`Thinned`]).

use super::FrontEndParams;
use super::batch::BatchReturn;
use super::thinned::Thinned;
use crate::centroid_ekf::{CentroidEkf, CentroidParams};
use crate::{ObjectReturn, ObjectState, RETURNS_MAX};
use raywake_core::encoder::ColumnClass;

/// Maximum number of filter states that a track keeps.
pub const HISTORY_MAX: usize = 512;
/// Maximum number of returns of its last batch that a track keeps.
pub const LATEST_MAX: usize = 256;

/// Stage in the life of a track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrackStatus {
    /// A free slot.
    #[default]
    Free,
    /// Tracked.
    Live,
    /// Ended; its slot is free from the next step on.
    Ended,
}

/// An object followed over time, with room for the given numbers of returns and states: by default
/// all that an estimate at its end uses.
#[derive(Clone, Debug, Default)]
pub struct Track<const RETURNS: usize = RETURNS_MAX, const HISTORY: usize = HISTORY_MAX> {
    /// Number among all tracks, from 0 in order of birth.
    pub id: u32,
    /// Stage in its life.
    pub status: TrackStatus,
    /// Point in the world that its positions are relative to, m: its first centroid.
    pub anchor: [f64; 3],
    /// Time of its first centroid, s.
    pub start_s: f64,
    /// Number of centroids observed.
    pub observations: u32,
    pub(super) ekf: Option<CentroidEkf>,
    history: Thinned<ObjectState, HISTORY>,
    returns: Thinned<ObjectReturn, RETURNS>,
    latest: Thinned<ObjectReturn, LATEST_MAX>,
    evidence: ReturnEvidence,
    /// Mean P(moves) of its returns at every state of the history.
    p_moves: Thinned<f32, HISTORY>,
    variances: Thinned<StateVariances, HISTORY>,
}

/// The filter's uncertainty about a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StateVariances {
    /// Covariance of the position (xx, xy, yy, zz), m².
    pub position: [f32; 4],
    /// Variance of the heading, rad².
    pub heading: f32,
    /// Variance of the speed, (m/s)².
    pub speed: f32,
    /// Variance of the turn rate, (rad/s)².
    pub turn_rate: f32,
}

impl StateVariances {
    fn of(ekf: &CentroidEkf) -> StateVariances {
        let at = |row, column| ekf.covariance()[(row, column)] as f32;
        StateVariances {
            position: [at(0, 0), at(0, 1), at(1, 1), at(2, 2)],
            heading: at(3, 3),
            speed: at(4, 4),
            turn_rate: at(6, 6),
        }
    }
}

/// What flow and encoder say about its returns.
#[derive(Clone, Copy, Debug, Default)]
struct ReturnEvidence {
    /// For the last observation: the sum of P(moves), and the number of returns in it.
    p_moves: (f32, u32),
    /// Number of returns of each class, in the order of [`ColumnClass::ALL`], in all observations.
    classes: [u32; ColumnClass::ALL.len()],
    /// Number of observations in which it was seen to move.
    moving: u32,
}

impl ReturnEvidence {
    const NONE: ReturnEvidence =
        ReturnEvidence { p_moves: (0.0, 0), classes: [0; ColumnClass::ALL.len()], moving: 0 };
}

impl<const RETURNS: usize, const HISTORY: usize> Track<RETURNS, HISTORY> {
    /// A free slot.
    pub const fn new() -> Self {
        Track {
            id: 0,
            status: TrackStatus::Free,
            anchor: [0.0; 3],
            start_s: 0.0,
            observations: 0,
            ekf: None,
            history: Thinned::new(),
            returns: Thinned::new(),
            latest: Thinned::new(),
            evidence: ReturnEvidence::NONE,
            p_moves: Thinned::new(),
            variances: Thinned::new(),
        }
    }

    /// States after its updates, as revised by the filter: before heading and speed were known,
    /// they are those learned later.
    pub fn history(&self) -> &[ObjectState] {
        self.history.kept()
    }

    /// Its returns, batch by batch, in the order of their sweeps.
    pub fn returns(&self) -> &[ObjectReturn] {
        self.returns.kept()
    }

    /// Returns of its last observation.
    pub fn latest(&self) -> &[ObjectReturn] {
        self.latest.kept()
    }

    /// Number of returns seen in total.
    pub fn returns_seen(&self) -> u64 {
        self.returns.seen()
    }

    /// The filter's uncertainty about every state of [`Track::history`] at its time.
    pub fn variances(&self) -> &[StateVariances] {
        self.variances.kept()
    }

    /// The filter's uncertainty about its current state.
    pub fn variances_now(&self) -> Option<StateVariances> {
        self.ekf.as_ref().map(StateVariances::of)
    }

    /// Distance from the position of its first state to that of its last one, along the ground, m.
    pub fn moved_m(&self) -> f64 {
        let (Some(first), Some(last)) = (self.history().first(), self.state()) else {
            return 0.0;
        };
        let [x, y] = [0, 1].map(|a| last.position[a] - first.position[a]);
        libm::hypot(x, y)
    }

    /// Mean P(moves) of its returns at every state of [`Track::history`], 0 to 1; NaN if the flow
    /// gives none.
    pub fn p_moves(&self) -> &[f32] {
        self.p_moves.kept()
    }

    /// Mean P(moves) at its last observation; none if the flow gives none.
    pub fn p_moves_now(&self) -> Option<f32> {
        let (sum, returns) = self.evidence.p_moves;
        (returns > 0).then(|| sum / returns as f32)
    }

    /// The class that the encoder assigns to most of its returns; none if it assigns none.
    pub fn class(&self) -> Option<ColumnClass> {
        let count = |class: &ColumnClass| self.evidence.classes[*class as usize];
        // The first of equal ones.
        let most = ColumnClass::ALL.into_iter().rev().max_by_key(count)?;
        (count(&most) > 0).then_some(most)
    }

    /// Share of its classified returns that have that class, 0 to 1.
    pub fn class_share(&self) -> f32 {
        let most = self.evidence.classes.into_iter().max().unwrap_or(0);
        most as f32 / self.evidence.classes.iter().sum::<u32>().max(1) as f32
    }

    /// Whether flow and encoder show that it is a road user: it was seen to move in as many
    /// observations as a track needs and got somewhere, or most of its classified returns are of
    /// classes that could move. Outside the flow's window nothing is.
    pub fn is_object(&self, params: &FrontEndParams) -> bool {
        let classified: u32 = self.evidence.classes.iter().sum();
        let count = |class: ColumnClass| self.evidence.classes[class as usize];
        let users = ColumnClass::ALL.into_iter().filter(|c| c.could_move()).map(count).sum::<u32>();
        let is_user =
            classified > 0 && users as f32 >= params.road_user_share_min * classified as f32;
        let moved = self.evidence.moving >= params.observations_min;
        is_user || moved && self.moved_m() >= params.track_way_min_m
    }

    /// The filter's state; none for a free slot.
    pub fn state(&self) -> Option<ObjectState> {
        self.ekf.as_ref().map(CentroidEkf::state)
    }

    /// Time of the filter's last update, s.
    pub fn last_s(&self) -> f64 {
        self.start_s + self.ekf.as_ref().map_or(0.0, CentroidEkf::time_s)
    }

    pub(super) fn free(&mut self) {
        self.status = TrackStatus::Free;
        self.ekf = None;
        self.observations = 0;
        self.history.clear();
        self.returns.clear();
        self.latest.clear();
        self.evidence = ReturnEvidence::NONE;
        self.p_moves.clear();
        self.variances.clear();
    }

    /// Begins a track at a point in the world.
    pub(super) fn begin(&mut self, id: u32, params: &CentroidParams, time_s: f64, at: [f64; 3]) {
        self.free();
        (self.id, self.status) = (id, TrackStatus::Live);
        (self.anchor, self.start_s) = (at, time_s);
        let ekf = CentroidEkf::birth(params, 0.0, [0.0; 3]);
        self.history.push(ekf.state());
        self.variances.push(StateVariances::of(&ekf));
        self.ekf = Some(ekf);
        self.observations = 1;
    }

    /// Converts a point in the world to one relative to the anchor.
    pub(super) fn place(&self, at: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|a| at[a] - self.anchor[a])
    }

    /// Updates the filter with a centroid in the world.
    pub(super) fn observe(&mut self, params: &CentroidParams, time_s: f64, at: [f64; 3]) {
        let place = self.place(at);
        let Some(ekf) = &mut self.ekf else { return };
        ekf.predict(params, time_s - self.start_s);
        let revision = ekf.update(params, place);
        let state = ekf.state();
        self.variances.push(StateVariances::of(ekf));
        revision.revise(&state, self.history.kept_mut());
        self.history.push(state);
        self.latest.clear();
        self.evidence.p_moves = (0.0, 0);
        self.observations += 1;
    }

    /// Completes an observation, after all its returns.
    pub(super) fn complete(&mut self, params: &FrontEndParams) {
        if self.status != TrackStatus::Live || self.p_moves.seen() >= self.history.seen() {
            return;
        }
        let mean = self.p_moves_now().unwrap_or(f32::NAN);
        self.evidence.moving += u32::from(mean >= params.track_moves_min);
        self.p_moves.push(mean);
    }

    /// Keeps a return, given the world positions of the return and of its ray's origin.
    pub(super) fn keep(&mut self, time_s: f64, at: [f64; 3], origin: [f64; 3], one: &BatchReturn) {
        let place = |at| self.place(at).map(|v| v as f32);
        let kept = ObjectReturn {
            position: place(at),
            origin: place(origin),
            time_s: (time_s - self.start_s) as f32,
            sensor: one.sensor,
            passed: one.passed,
        };
        self.returns.push(kept);
        self.latest.push(kept);
        if let Some(p) = one.p_moves {
            self.evidence.p_moves = (self.evidence.p_moves.0 + p, self.evidence.p_moves.1 + 1);
        }
        if let Some(class) = one.class {
            self.evidence.classes[class as usize] += 1;
        }
    }
}
