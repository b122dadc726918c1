//! What the front ends find of labelled objects: how many, in how many pieces, and how well these
//! are tracked.

use super::evaluate::{Outcome, evaluate};
use super::object::{Moment, Object, moment_at};
use super::recorded::Recorded;
use glam::DVec3;
use raywake::args::{FlowChoice, FrontEndKind};
use raywake::choose;
use raywake::config;
use raywake::error::RunError;
use raywake::track::Tracker;
use raywake::weight_files::WeightFiles;
use raywake_io::source::{self, OpenOptions, SweepData};
use raywake_objects::ObjectReturn;
use raywake_objects::front_end::Track;
use std::ops::Range;
use std::path::Path;

/// Maximum number of returns of a track that identify its object, evenly spaced in their order.
const SAMPLE: usize = 2000;

/// How far outside a box its returns may lie, m.
const MARGIN_M: f64 = 0.25;

/// Tracks with fewer observations are ignored as too short.
const OBSERVATIONS: usize = 10;

/// A track's object is determined in intervals of this length, by most of its returns, s.
const OWNED_S: f64 = 1.0;

/// Results of one front end on the labelled objects of some drives.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Labelled objects, and those with at least one track.
    pub objects: [usize; 2],
    /// Tracks, and those of a labelled object.
    pub tracks: [usize; 2],
    /// Tracks of an object beyond its first, summed over all objects.
    pub fragments: usize,
    /// Number of times that a track switches from one object to another.
    pub swaps: usize,
    /// The longest track of each object found.
    pub outcomes: Vec<Outcome>,
}

impl Found {
    /// Adds a drive, run through the front end of a kind.
    ///
    /// Fails if the drive cannot be read or the flow has no backend.
    pub fn add(
        &mut self,
        path: &Path,
        kind: FrontEndKind,
        labelled: &Recorded,
        flow: &FlowChoice,
        jobs: usize,
    ) -> Result<(), RunError> {
        let tracks = follow(path, kind, flow)?;
        let objects: Vec<&Object> = labelled.stationary.iter().chain(&labelled.moving).collect();
        let mut longest: Vec<Option<&Track>> = vec![None; objects.len()];
        self.objects[0] += objects.len();
        for track in tracks.iter().filter(|t| t.history().len() >= OBSERVATIONS) {
            self.tracks[0] += 1;
            let owners = owners(track, &objects);
            self.swaps += swaps(&owners);
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
        let (objects, histories): (Vec<Object>, Vec<_>) = seen
            .map(|(object, track)| (as_tracked(object, track), track.history().to_vec()))
            .unzip();
        self.outcomes.extend(evaluate(&objects, &histories, jobs));
        Ok(())
    }
}

fn follow(path: &Path, kind: FrontEndKind, flow: &FlowChoice) -> Result<Vec<Track>, RunError> {
    let mut source = source::open(path, &OpenOptions::default())?;
    let tracking = config::settings(&flow.profile)?;
    let profile = &tracking.profile;
    let drive = match kind {
        FrontEndKind::Variance => None,
        FrontEndKind::Flow => {
            let weights = WeightFiles::read(&flow.learned, profile)?;
            Some(choose::drive(&flow.backend, &weights, profile, source.rig())?.drive)
        }
    };
    let mut tracker = Tracker::new(source.rig(), &tracking, drive, None, false)?;
    let mut tracks = Vec::new();
    let mut keep = |tracker: &Tracker| tracks.extend(tracker.ended_tracks().cloned());
    let (mut now, mut before) = (SweepData::default(), SweepData::default());
    for index in 0..source.len() {
        source.read(index, &mut now)?;
        if tracker.sweep(&now, (index > 0).then_some(&before))?.is_some() {
            keep(&tracker);
        }
        std::mem::swap(&mut now, &mut before);
    }
    if tracker.last(&before)?.is_some() {
        keep(&tracker);
    }
    tracker.finish()?;
    keep(&tracker);
    Ok(tracks)
}

/// Times of some returns of a track, s after its start, and the object each lies on.
fn owners(track: &Track, objects: &[&Object]) -> Vec<(f64, Option<usize>)> {
    let returns = track.returns();
    let some = returns.iter().step_by(returns.len().div_ceil(SAMPLE).max(1));
    let owner = |r: &ObjectReturn| {
        let time_s = f64::from(r.time_s);
        let place = DVec3::from_array(track.anchor) + DVec3::from_array(r.position.map(f64::from));
        (time_s, owner(objects, track.start_s + time_s, place))
    };
    some.map(owner).collect()
}

/// The object whose box contains a place in the world at a time of the drive.
fn owner(objects: &[&Object], time_s: f64, place: DVec3) -> Option<usize> {
    let holds = |object: &&Object| {
        let after_s = time_s - object.start_s;
        if !(-0.1..object.span_s() + 0.1).contains(&after_s) {
            return false;
        }
        let off = moment_at(&object.truth, after_s).project(place - object.anchor);
        let half = 0.5 * DVec3::from_array(object.size) + MARGIN_M;
        off.abs().cmple(half).all()
    };
    objects.iter().position(holds)
}

/// The object on which more than half of some returns lie.
fn majority(owners: impl Iterator<Item = Option<usize>>) -> Option<usize> {
    let (mut counts, mut all) = (std::collections::BTreeMap::new(), 0);
    for owner in owners {
        all += 1;
        *counts.entry(owner).or_insert(0) += 1;
    }
    counts.into_iter().find(|(_, count)| 2 * count > all).and_then(|(owner, _)| owner)
}

/// How often the object of a track's returns changes.
fn swaps(owners: &[(f64, Option<usize>)]) -> usize {
    let bin = |owner: &(f64, Option<usize>)| (owner.0 / OWNED_S).floor();
    let bins = owners.chunk_by(|a, b| bin(a) == bin(b));
    let of_bins: Vec<usize> = bins.filter_map(|b| majority(b.iter().map(|o| o.1))).collect();
    of_bins.windows(2).filter(|o| o[0] != o[1]).count()
}

/// An object as seen by a track: with the track's returns, batches and times.
fn as_tracked(object: &Object, track: &Track) -> Object {
    let anchor = DVec3::from_array(track.anchor);
    let mut returns = track.returns().to_vec();
    returns.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    // A batch for each update of the filter, of the returns closest to it in time.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn majorities_and_swaps() {
        let owners = |text: &str| -> Vec<(f64, Option<usize>)> {
            let of = |(n, c): (usize, char)| (0.25 * n as f64, c.to_digit(10).map(|d| d as usize));
            text.chars().enumerate().map(of).collect()
        };
        let most = |text: &str| majority(owners(text).into_iter().map(|o| o.1));
        assert_eq!(
            (most("1112"), most("1122"), most("111---"), most("")),
            (Some(1), None, None, None)
        );
        // Four a second; a second without a majority is ignored.
        let count = |text: &str| swaps(&owners(text));
        assert_eq!((count("11112222"), count("1111111222222222")), (1, 1));
        assert_eq!((count("1111222211112222"), count("1111----1111"), count("")), (3, 0, 0));
    }

    /// Boxes of two objects, and places inside and outside them over time.
    #[test]
    fn tracks_belong_to_the_object_whose_box_contains_them() {
        let object = |x: f64, speed: f64| {
            let moment = |n: usize| Moment {
                time_s: 0.1 * n as f64,
                position: DVec3::new(x + 0.1 * speed * n as f64, 0.0, 1.0),
                ..Moment::default()
            };
            let at = |time_s| ObjectReturn { time_s, ..ObjectReturn::default() };
            Object {
                name: String::new(),
                kind: crate::labels::Kind::Car,
                size: [4.0, 2.0, 1.5],
                stationary: speed == 0.0,
                anchor: DVec3::new(100.0, 50.0, 0.0),
                start_s: 7.0,
                returns: vec![at(0.0), at(2.0)],
                batches: vec![0..1, 1..2],
                truth: (0..=20).map(moment).collect(),
            }
        };
        let (still, moving) = (object(0.0, 0.0), object(-15.0, 10.0));
        let objects = [&still, &moving];
        let holder = |time_s: f64, at: [f64; 3]| owner(&objects, time_s, DVec3::from_array(at));
        assert_eq!(holder(7.5, [101.9, 50.0, 1.0]), Some(0));
        assert_eq!(holder(7.5, [103.0, 50.0, 1.0]), None);
        assert_eq!(holder(7.5, [91.0, 50.9, 1.2]), Some(1));
        assert_eq!(holder(8.0, [91.0, 50.9, 1.2]), None, "it has gone on");
        assert_eq!(holder(9.5, [101.0, 50.0, 1.0]), None, "not labelled then");
    }
}
