//! Matches labels to their sweeps.

use super::{Kind, Labels, Track};
use raywake_core::pose::Pose;
use raywake_io::source::Source;
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Stamps and poses of a source's sweeps, by frame.
pub(super) struct Sweeps {
    index: HashMap<u64, usize>,
    moments: Vec<(f64, Pose)>,
}

impl Sweeps {
    pub fn of(source: &dyn Source) -> Sweeps {
        let all = 0..source.len();
        Sweeps {
            index: all.clone().map(|i| (source.frame(i), i)).collect(),
            moments: all.map(|i| (source.stamp_s(i), source.pose(i))).collect(),
        }
    }

    /// Index of a frame's sweep.
    pub fn index(&self, frame: u64) -> Option<usize> {
        self.index.get(&frame).copied()
    }

    /// Stamp (s) and `world_from_vehicle` of sweep `index`.
    pub fn moment(&self, index: usize) -> (f64, Pose) {
        self.moments[index]
    }
}

/// Highest plausible speed of a kind over ground, m/s: beyond it a track jumps from one object to
/// another, or a box was misplaced.
fn speed_max(kind: Kind) -> f64 {
    match kind {
        Kind::Pedestrian => 15.0,
        Kind::Cyclist => 30.0,
        _ => 70.0,
    }
}

/// Drops boxes of frames without a sweep; cuts tracks where they jump: where getting from one box
/// to the next would exceed the kind's highest speed over ground, or the heading turns by more than
/// a right angle. The parts become separate tracks, the later ones named `ID/2`, `ID/3` and so on.
/// The notes count all of these, and sweeps without a box.
pub(super) fn fit(labels: &mut Labels, sweeps: &Sweeps) {
    let mut without_sweep = 0;
    for track in &mut labels.tracks {
        let before = track.boxes.len();
        track.boxes.retain(|&frame, _| sweeps.index(frame).is_some());
        without_sweep += before - track.boxes.len();
    }
    labels.tracks.retain(|t| !t.boxes.is_empty());
    let (whole, mut jumps) = (std::mem::take(&mut labels.tracks), 0);
    for track in whole {
        let parts = cut(track, sweeps);
        jumps += parts.len() - 1;
        labels.tracks.extend(parts);
    }
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            labels.notes.push(format!("{count} {what}"));
        }
    };
    note(without_sweep, "boxes left out: their frame has no sweep");
    note(jumps, "jumps within tracks, which were cut there");
    let mut empty = vec![true; sweeps.moments.len()];
    for frame in labels.tracks.iter().flat_map(|t| t.boxes.keys()) {
        sweeps.index(*frame).into_iter().for_each(|i| empty[i] = false);
    }
    note(empty.iter().filter(|e| **e).count(), "sweeps without a box");
}

/// The parts of a track between its jumps, in order of time.
fn cut(track: Track, sweeps: &Sweeps) -> Vec<Track> {
    let mut parts: Vec<Track> = Vec::new();
    let mut last: Option<(f64, Pose)> = None;
    for (&frame, &vehicle_from_box) in &track.boxes {
        let Some(index) = sweeps.index(frame) else { continue };
        let (stamp_s, world_from_vehicle) = sweeps.moment(index);
        let here = (stamp_s, world_from_vehicle * vehicle_from_box);
        if last.is_none_or(|last| jumps(track.kind, last, here)) {
            let id = match parts.len() {
                0 => track.id.clone(),
                n => format!("{}/{}", track.id, n + 1),
            };
            let class = track.class.clone();
            parts.push(Track { id, class, boxes: BTreeMap::new(), ..track });
        }
        parts.iter_mut().last().map(|part| part.boxes.insert(frame, vehicle_from_box));
        last = Some(here);
    }
    parts
}

/// Whether two moments, s and `world_from_box`, cannot belong to one motion.
fn jumps(kind: Kind, a: (f64, Pose), b: (f64, Pose)) -> bool {
    let far = (b.1.translation - a.1.translation).length() > speed_max(kind) * (b.0 - a.0);
    far || turn(a.1.yaw_rad(), b.1.yaw_rad()).abs() > FRAC_PI_2
}

/// The signed angle from one heading to another, -pi to pi, rad.
pub fn turn(from_rad: f64, to_rad: f64) -> f64 {
    (to_rad - from_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Road, labels_of, track};
    use super::*;

    fn fitted(boxes: impl Iterator<Item = (u64, Pose)>, moves: f64) -> Labels {
        let road = Road::of((0..6).map(|i| {
            let t = 0.1 * i as f64;
            (t, Pose::planar(moves * t, 0.0, 0.0, 0.0))
        }));
        let mut labels = labels_of([track("a", boxes)]);
        fit(&mut labels, &Sweeps::of(&road));
        labels
    }

    #[test]
    fn tracks_are_cut_at_jumps() {
        let at = |x: f64, yaw: f64| Pose::planar(x, 0.0, 0.0, yaw);
        // 5 m in 0.1 s is not a jump for a car, 8 m is.
        let steady = fitted((0..6).map(|f| (f, at(5.0 * f as f64, 0.0))), 0.0);
        assert_eq!((steady.tracks.len(), steady.notes.len()), (1, 0));
        let jumping = fitted((0..6).map(|f| (f, at(if f < 2 { 0.0 } else { 8.0 }, 0.0))), 0.0);
        assert_eq!(jumping.notes, ["1 jumps within tracks, which were cut there"]);
        let parts: Vec<_> = jumping.tracks.iter().map(|t| (t.id.as_str(), t.boxes.len())).collect();
        assert_eq!(parts, [("a", 2), ("a/2", 4)]);
        assert_eq!(jumping.tracks[1].class, "Car");
        // Whatever stays beside a vehicle at 80 m/s is as fast.
        assert_eq!(fitted((0..6).map(|f| (f, at(3.0, 0.0))), 80.0).tracks.len(), 6);
        let turned = fitted((0..6).map(|f| (f, at(3.0, if f < 5 { 1.5 } else { -1.6 }))), 0.0);
        assert_eq!(turned.tracks.len(), 2);
        // Wrapping around pi is not a turn.
        let seam = fitted((0..6).map(|f| (f, at(3.0, if f < 3 { 3.1 } else { -3.1 }))), 0.0);
        assert_eq!(seam.tracks.len(), 1);
    }

    #[test]
    fn sweeps_and_frames_that_do_not_match() {
        let labels = fitted([2, 3, 7, 8].into_iter().map(|f| (f, Pose::IDENTITY)), 0.0);
        let expected = ["2 boxes left out: their frame has no sweep", "4 sweeps without a box"];
        assert_eq!(labels.notes, expected);
        assert_eq!(labels.tracks[0].boxes.len(), 2);
        let none = fitted([7].into_iter().map(|f| (f, Pose::IDENTITY)), 0.0);
        assert!(none.tracks.is_empty() && none.notes[1] == "6 sweeps without a box");
    }

    #[test]
    fn turns() {
        for (from, to, expected) in
            [(3.1, -3.1, TAU - 6.2), (0.5, 0.2, -0.3), (-3.0, 9.0, 12.0 - 2.0 * TAU)]
        {
            assert!((turn(from, to) - expected).abs() < 1e-12, "{from} {to}");
        }
    }
}
