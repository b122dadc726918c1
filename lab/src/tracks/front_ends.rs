//! What the front ends find of labelled objects: how many, in how many pieces, and how well these
//! are tracked.

use super::evaluate::{Outcome, evaluate};
use super::object::{Moment, Object, moment_at};
use super::recorded::Recorded;
use glam::DVec3;
use raywake::args::{BackendChoice, FrontEndKind, Learned, ProfileChoice};
use raywake::choose;
use raywake::config::{self, Weights};
use raywake::drive::Drive;
use raywake::error::Error;
use raywake::source::{self, OpenOptions, SweepData};
use raywake::track::Tracker;
use raywake_core::objects::front_end::Track;
use std::ops::Range;
use std::path::Path;

/// Returns of a track by which its object is told, at most, evenly in their order.
const SAMPLE: usize = 2000;

/// How far a return of a box lies outside of it at most, m.
const MARGIN_M: f64 = 0.25;

/// Tracks of fewer observations are none: they are too short to be anything.
const OBSERVATIONS: usize = 10;

/// An object is someone else's where most of a track's returns within such a time are, s.
const OWNED_S: f64 = 1.0;

/// What a front end needs.
pub struct Settings<'a> {
    /// Of the flow.
    pub profile: &'a ProfileChoice,
    /// Of the flow.
    pub learned: &'a Learned,
    /// Of the flow.
    pub backend: &'a BackendChoice,
}

/// What one front end finds of the labelled objects of some drives.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Labelled objects, and those with a track of their own.
    pub objects: [usize; 2],
    /// Tracks, and those of a labelled object.
    pub tracks: [usize; 2],
    /// Tracks of an object beyond its first, all objects together.
    pub fragments: usize,
    /// Times that a track goes over from an object to another.
    pub swaps: usize,
    /// The longest track of each object found.
    pub outcomes: Vec<Outcome>,
}

impl Found {
    /// Adds a drive, through the front end of a kind.
    ///
    /// Fails where the drive cannot be read or the flow has no backend.
    pub fn add(
        &mut self,
        path: &Path,
        kind: FrontEndKind,
        labelled: &Recorded,
        settings: &Settings,
        jobs: usize,
    ) -> Result<(), Error> {
        let tracks = follow(path, kind, settings)?;
        let objects: Vec<&Object> = labelled.stationary.iter().chain(&labelled.moving).collect();
        let mut longest: Vec<Option<&Track>> = vec![None; objects.len()];
        self.objects[0] += objects.len();
        for track in tracks.iter().filter(|t| t.history().len() >= OBSERVATIONS) {
            self.tracks[0] += 1;
            let owners = owners(track, &objects);
            self.swaps += swaps(track, &owners);
            let Some(owner) = majority(owners.iter().map(|o| o.1)) else { continue };
            self.tracks[1] += 1;
            match &mut longest[owner] {
                None => {
                    self.objects[1] += 1;
                    longest[owner] = Some(track);
                }
                Some(other) => {
                    self.fragments += 1;
                    if track.observations > other.observations {
                        *other = track;
                    }
                }
            }
        }
        let seen = objects.iter().zip(longest).filter_map(|(o, t)| Some((o, t?)));
        let (objects, histories): (Vec<Object>, Vec<_>) =
            seen.map(|(object, track)| (seen_as(object, track), track.history().to_vec())).unzip();
        self.outcomes.extend(evaluate(&objects, &histories, jobs));
        Ok(())
    }
}

/// Stack of the thread of the flow: see [`Tracker::new`].
const STACK: usize = 64 << 20;

/// All tracks of a drive.
fn follow(path: &Path, kind: FrontEndKind, settings: &Settings) -> Result<Vec<Track>, Error> {
    let work = || -> Result<Vec<Track>, Error> {
        let mut source = source::open(path, &OpenOptions::default())?;
        let drive = match kind {
            FrontEndKind::Variance => None,
            FrontEndKind::Flow => {
                let profile = config::profile(settings.profile)?;
                let weights = Weights::read(settings.learned, &profile)?;
                let chosen =
                    choose::backend(settings.backend, &profile, weights.tables(&profile)?)?;
                let mut backend = chosen.backend;
                backend.seal();
                Some(Drive::new(&profile, source.rig(), &weights.tables(&profile)?, backend))
            }
        };
        let mut tracker = Tracker::new(source.rig(), drive);
        let mut tracks = Vec::new();
        let mut keep = |tracker: &mut Tracker| {
            tracker.ended(|ended| {
                tracks.push(ended.track.clone());
                Ok(())
            })
        };
        let (mut now, mut before) = (SweepData::default(), SweepData::default());
        for index in 0..source.len() {
            source.read(index, &mut now)?;
            if tracker.sweep(&now, (index > 0).then_some(&before))?.is_some() {
                keep(&mut tracker)?;
            }
            std::mem::swap(&mut now, &mut before);
        }
        if tracker.last(&before).is_some() {
            keep(&mut tracker)?;
        }
        tracker.finish();
        keep(&mut tracker)?;
        Ok(tracks)
    };
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK);
        let thread = thread.spawn_scoped(scope, work).expect("the system has threads");
        thread.join().expect("the front end panicked")
    })
}

/// Times of some returns of a track, s after its start, and the object each lies on.
fn owners(track: &Track, objects: &[&Object]) -> Vec<(f64, Option<usize>)> {
    let returns = track.returns();
    let some = returns.iter().step_by(returns.len().div_ceil(SAMPLE).max(1));
    let owner = |r: &raywake_core::objects::ObjectReturn| {
        let time_s = f64::from(r.time_s);
        let place = DVec3::from_array(track.anchor) + DVec3::from_array(r.position.map(f64::from));
        let holds = |object: &&Object| {
            let after_s = track.start_s + time_s - object.start_s;
            if !(-0.1..object.span_s() + 0.1).contains(&after_s) {
                return false;
            }
            let off = moment_at(&object.truth, after_s).project(place - object.anchor);
            let half = 0.5 * DVec3::from_array(object.size) + MARGIN_M;
            off.abs().cmple(half).all()
        };
        (time_s, objects.iter().position(holds))
    };
    some.map(owner).collect()
}

/// The object that more than half of some returns lie on.
fn majority(owners: impl Iterator<Item = Option<usize>>) -> Option<usize> {
    let (mut counts, mut all) = (std::collections::BTreeMap::new(), 0);
    for owner in owners {
        all += 1;
        *counts.entry(owner).or_insert(0) += 1;
    }
    counts.into_iter().find(|(_, count)| 2 * count > all).and_then(|(owner, _)| owner)
}

/// How often the object of a track's returns changes.
fn swaps(track: &Track, owners: &[(f64, Option<usize>)]) -> usize {
    let bin = |owner: &(f64, Option<usize>)| (owner.0 / OWNED_S).floor();
    debug_assert!(track.returns().len() >= owners.len());
    let bins = owners.chunk_by(|a, b| bin(a) == bin(b));
    let of_bins: Vec<usize> = bins.filter_map(|b| majority(b.iter().map(|o| o.1))).collect();
    of_bins.windows(2).filter(|o| o[0] != o[1]).count()
}

/// An object as a track has it: with the track's returns, batches and times.
fn seen_as(object: &Object, track: &Track) -> Object {
    let anchor = DVec3::from_array(track.anchor);
    let mut returns = track.returns().to_vec();
    returns.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    // A batch for each update of the filter, as near in time as any.
    let mut batches: Vec<Range<usize>> = Vec::new();
    for state in track.history() {
        let from = batches.last().map_or(0, |b| b.end);
        let end = returns.partition_point(|r| f64::from(r.time_s) < state.time_s + 0.05);
        if end > from {
            batches.push(from..end);
        }
    }
    let later_s = track.start_s - object.start_s;
    let moment = |m: &Moment| Moment {
        time_s: m.time_s - later_s,
        position: m.position + object.anchor - anchor,
        ..*m
    };
    Object {
        anchor,
        start_s: track.start_s,
        returns,
        batches,
        truth: object.truth.iter().map(moment).collect(),
        ..object.clone()
    }
}
