//! Gathers rows of boxes, from any file, into tracks.

use super::{Kind, Labels, Track, View, kind::kind};
use glam::DQuat;
use raywake_core::plausible::{FRAME_MAX_M, WORLD_MAX_M, is_within};
use raywake_core::pose::Pose;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashMap};

/// One box as given in a file, not yet checked.
pub(super) struct LabelRow<'a> {
    pub id: &'a str,
    pub class: &'a str,
    pub frame: u64,
    /// Length, width and height, m.
    pub size: [f64; 3],
    /// `vehicle_from_box`, in the box's centre: position, m, and quaternion.
    pub centre: [f64; 3],
    pub rotation: DQuat,
}

/// A heading about +z as a quaternion.
pub(super) fn heading(yaw_rad: f64) -> DQuat {
    Pose::planar(0.0, 0.0, 0.0, yaw_rad).rotation
}

/// Collects the rows of a file.
#[derive(Default)]
pub(super) struct Gather {
    tracks: Vec<Track>,
    by_id: HashMap<String, usize>,
    /// Reason and number of everything left out or noted.
    left_out: BTreeMap<&'static str, u64>,
    /// Unknown classes.
    unknown: BTreeMap<String, u64>,
}

/// Largest difference from a track's first size that counts as rounding, m.
const SIZE_TOLERANCE: f64 = 0.01;

impl Gather {
    /// Takes a box, or counts why it cannot be used.
    pub fn add(&mut self, row: &LabelRow) {
        match usable(row) {
            Ok(pose) => self.place(row, pose),
            Err(why) => self.leave_out(why),
        }
    }

    /// Counts something under its reason.
    pub fn leave_out(&mut self, why: &'static str) {
        *self.left_out.entry(why).or_default() += 1;
    }

    fn place(&mut self, row: &LabelRow, pose: Pose) {
        let index = match self.by_id.get(row.id) {
            Some(&index) => index,
            None => self.start(row),
        };
        let track = &mut self.tracks[index];
        let differs = |a: [f64; 3]| (0..3).any(|i| (a[i] - row.size[i]).abs() > SIZE_TOLERANCE);
        let (resized, renamed) = (differs(track.size), track.class != row.class);
        let twice = match track.boxes.entry(row.frame) {
            Entry::Vacant(place) => {
                place.insert(pose);
                false
            }
            Entry::Occupied(_) => true,
        };
        if twice {
            self.leave_out("boxes left out: the track already has one in that frame");
        } else if renamed {
            self.leave_out("boxes whose class differs from that of their track's first box");
        } else if resized {
            self.leave_out("boxes whose size differs from that of their track's first box");
        }
    }

    /// A new track; returns its index.
    fn start(&mut self, row: &LabelRow) -> usize {
        let kind = kind(row.class).unwrap_or_else(|| {
            *self.unknown.entry(row.class.into()).or_default() += 1;
            Kind::Other
        });
        let (id, class) = (row.id.to_owned(), row.class.to_owned());
        self.by_id.insert(id.clone(), self.tracks.len());
        self.tracks.push(Track { id, class, kind, size: row.size, boxes: BTreeMap::new() });
        self.tracks.len() - 1
    }

    /// The collected labels, with a note for every reason.
    pub fn finish(self, view: View) -> Labels {
        let mut notes: Vec<String> =
            self.left_out.iter().map(|(why, count)| format!("{count} {why}")).collect();
        for (class, count) in &self.unknown {
            notes.push(format!("unknown class `{class}`: {count} tracks counted as other"));
        }
        Labels { tracks: self.tracks, view, exact: false, notes }
    }
}

/// The pose of a valid row.
fn usable(row: &LabelRow) -> Result<Pose, &'static str> {
    let whole = |v: &[f64]| v.iter().all(|v| v.is_finite());
    if !whole(&row.centre) || !whole(&row.size) || !row.rotation.is_finite() {
        return Err("boxes left out: a NaN or infinite number");
    }
    if !is_within(row.centre.into(), WORLD_MAX_M) || !is_within(row.size.into(), FRAME_MAX_M) {
        return Err("boxes left out: farther away or larger than possible");
    }
    if row.size.iter().any(|&s| s <= 0.0) {
        return Err("boxes left out: length, width or height not positive");
    }
    if (row.rotation.length() - 1.0).abs() > 1e-3 {
        return Err("boxes left out: the quaternion is not of length 1");
    }
    Ok(Pose::new(row.rotation, row.centre.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(id: &str, frame: u64) -> LabelRow<'_> {
        let (size, centre) = ([4.0, 2.0, 1.5], [1.0, 2.0, 3.0]);
        LabelRow { id, class: "Car", frame, size, centre, rotation: heading(0.3) }
    }

    #[test]
    fn rows_become_tracks() {
        let mut g = Gather::default();
        for r in [row("a", 1), row("b", 1), row("a", 2)] {
            g.add(&r);
        }
        let labels = g.finish(View::All);
        assert!(labels.notes.is_empty(), "{:?}", labels.notes);
        let ids: Vec<_> = labels.tracks.iter().map(|t| (t.id.as_str(), t.boxes.len())).collect();
        assert_eq!(ids, [("a", 2), ("b", 1)]);
        let pose = labels.tracks[0].boxes[&2];
        assert!((pose.yaw_rad() - 0.3).abs() < 1e-12 && pose.translation.z == 3.0);
    }

    #[test]
    fn invalid_entries_are_counted() {
        let mut g = Gather::default();
        g.add(&LabelRow { centre: [f64::NAN, 0.0, 0.0], ..row("a", 1) });
        g.add(&LabelRow { rotation: heading(f64::INFINITY), ..row("a", 1) });
        g.add(&LabelRow { centre: [1.0, -1e300, 0.0], ..row("a", 1) });
        g.add(&LabelRow { size: [4.0, 1e300, 1.0], ..row("a", 1) });
        g.add(&LabelRow { size: [4.0, 0.0, 1.0], ..row("a", 1) });
        g.add(&LabelRow { rotation: heading(0.0) * 2.0, ..row("a", 1) });
        g.add(&LabelRow { class: "Zeppelin", ..row("z", 1) });
        g.add(&row("z", 1));
        g.add(&row("z", 2));
        g.add(&LabelRow { class: "Zeppelin", size: [5.0, 2.0, 1.5], ..row("z", 3) });
        let labels = g.finish(View::All);
        assert_eq!((labels.tracks.len(), labels.tracks[0].boxes.len()), (1, 3));
        assert_eq!(labels.tracks[0].kind, Kind::Other);
        let expected = [
            "1 boxes left out: length, width or height not positive",
            "2 boxes left out: a NaN or infinite number",
            "2 boxes left out: farther away or larger than possible",
            "1 boxes left out: the quaternion is not of length 1",
            "1 boxes left out: the track already has one in that frame",
            "1 boxes whose class differs from that of their track's first box",
            "1 boxes whose size differs from that of their track's first box",
            "unknown class `Zeppelin`: 1 tracks counted as other",
        ];
        for e in expected {
            assert!(labels.notes.iter().any(|n| n == e), "{e}: {:?}", labels.notes);
        }
        assert_eq!(labels.notes.len(), expected.len());
    }
}
