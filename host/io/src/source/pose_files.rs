//! Files of `world_from_vehicle` poses.
//!
//! | a row | as in | one per |
//! |---|---|---|
//! | 12 numbers, a 3x4 matrix | KITTI's `poses.txt` | sweep |
//! | 8 numbers: time in s, x, y, z, quaternion x, y, z, w | TUM's RGB-D benchmark | time |
//! | 4x4 numbers in a `.npy` | what `kiss-icp` writes | sweep |

use std::path::Path;

use raywake_core::plausible::is_time;
use raywake_core::pose::Pose;

use super::plausible::reach;
use super::poses::{pose_from, pose_row, rigid};
use super::trajectory::Trajectory;
use super::{npy, text, whole};
use crate::Error;

/// A stamp at most this far before the first or after the last pose takes that pose, ns: text
/// rounds times.
const SLACK_NS: i64 = 1_000_000;

/// Before the index of the sweep that the first row without a time belongs to, if that is not the
/// recording's first: a comment for other programs.
const FIRST: &str = "# first sweep: ";

/// A row of a file.
struct PoseRow {
    /// `line 3`, for messages.
    place: String,
    time_s: Option<f64>,
    pose: Pose,
}

/// The pose of a file at each of some stamps, ns; `None` where it has none.
///
/// Rows without times belong to the first sweeps, or those from the index after [`FIRST`] on; so do
/// rows with times of another clock if there is one for each sweep.
///
/// Fails if a row is not a pose, if one is out of reach of any drive, if there are more rows
/// without times than sweeps, and if no sweep has a pose.
pub(super) fn read(path: &Path, stamps_ns: &[i64]) -> Result<Vec<Option<Pose>>, Error> {
    let ((first, rows), sweeps) = (rows(path)?, stamps_ns.len());
    let timed = rows.first().is_some_and(|row| row.time_s.is_some());
    let by_time = if timed { at(&rows, stamps_ns) } else { Vec::new() };
    if by_time.iter().any(Option::is_some) {
        return Ok(by_time);
    }
    let expected = sweeps.saturating_sub(first);
    let fits = if timed { rows.len() == sweeps } else { (1..=expected).contains(&rows.len()) };
    if !fits {
        let times = if timed { " at other times than the sweeps" } else { "" };
        let what = format!("{} poses{times}, expected {expected}", rows.len());
        return Err(Error::input(path, "", what));
    }
    let mut poses = vec![None; if timed { 0 } else { first }];
    poses.extend(rows.iter().map(|row| Some(row.pose)));
    poses.resize(sweeps, None);
    Ok(poses)
}

/// The text of a file of the poses of a recording's sweeps from the index `first` on.
pub fn pose_rows(first: usize, poses: &[Pose]) -> String {
    let head = if first > 0 { format!("{FIRST}{first}\n") } else { String::new() };
    poses.iter().fold(head, |text, pose| text + &pose_row(pose) + "\n")
}

/// The pose in a file of one row.
///
/// Fails if the file cannot be read, or has no row, several, or one that is not a pose.
pub fn read_pose(path: &Path) -> Result<Pose, Error> {
    let poses = read(path, &[0])?;
    poses[0].ok_or_else(|| Error::input(path, "", "0 poses, expected 1"))
}

/// Keeps those of `all` that have a pose.
pub(super) fn keep<T>(all: &mut Vec<T>, poses: &[Option<Pose>]) {
    let mut known = poses.iter().map(Option::is_some);
    all.retain(|_| known.next().unwrap_or(false));
}

/// Adds a note on sweeps without a pose.
pub(super) fn note_missing(poses: &[Option<Pose>], name: &str, notes: &mut Vec<String>) {
    let missing = poses.iter().filter(|pose| pose.is_none()).count();
    if missing > 0 {
        notes.push(format!("{missing} sweeps skipped: no pose in {name}"));
    }
}

/// The poses of rows with times, at some stamps.
fn at(rows: &[PoseRow], stamps_ns: &[i64]) -> Vec<Option<Pose>> {
    let mut trajectory = Trajectory::default();
    for row in rows {
        let time_s = row.time_s.unwrap_or(0.0);
        trajectory.add((time_s * 1e9).round() as i64, row.pose);
    }
    trajectory.sort();
    stamps_ns.iter().map(|stamp_ns| trajectory.near(*stamp_ns, SLACK_NS)).collect()
}

/// All rows of a file, and the index of the sweep that the first belongs to.
fn rows(path: &Path) -> Result<(usize, Vec<PoseRow>), Error> {
    let (mut first_sweep, mut rows) = (0, Vec::new());
    if path.extension().is_some_and(|e| e == "npy") {
        let array = npy::read(path)?;
        for (n, numbers) in array.values.chunks(array.columns).enumerate() {
            rows.push(row(path, format!("row {n}"), numbers)?);
        }
    } else {
        let text = whole::read_text(path)?;
        if let Some((line, index)) = stated_first(&text) {
            let wrong = || Error::input(path, format!("line {line}"), "not the index of a sweep");
            first_sweep = index.trim().parse().map_err(|_| wrong())?;
        }
        for (line, content) in text::lines(&text).filter(|(_, text)| !text.starts_with('#')) {
            let numbers = text::numbers(path, line, content)?;
            rows.push(row(path, format!("line {line}"), &numbers)?);
        }
    }
    let Some(first) = rows.first() else { return Ok((first_sweep, rows)) };
    let (start, timed) = (first.pose.translation, first.time_s.is_some());
    for row in &rows {
        reach(start, &row.pose).map_err(|what| Error::input(path, &row.place, what))?;
        if row.time_s.is_some() != timed {
            let what = "some rows have a time and others do not";
            return Err(Error::input(path, &row.place, what));
        }
    }
    Ok((first_sweep, rows))
}

/// The line and text of the index of the first sweep, if it is stated.
fn stated_first(text: &str) -> Option<(usize, &str)> {
    text::lines(text).find_map(|(line, content)| Some((line, content.strip_prefix(FIRST)?)))
}

fn row(path: &Path, place: String, numbers: &[f64]) -> Result<PoseRow, Error> {
    let wrong = |what: &str| Error::input(path, place.clone(), what);
    let (time_s, pose) = match *numbers {
        [time_s, x, y, z, a, b, c, d] => {
            let pose = rigid([x, y, z], [a, b, c, d]).map_err(wrong)?;
            // Written this way because NaN is in no range.
            if !is_time(time_s) {
                return Err(wrong(&format!("an impossible time of {time_s} s")));
            }
            (Some(time_s), pose)
        }
        _ => {
            let matrix = numbers.first_chunk().filter(|_| matches!(numbers.len(), 12 | 16));
            let matrix = matrix.ok_or_else(|| {
                let found = numbers.len();
                wrong(&format!(
                    "12 numbers (a 3x4 matrix) or 8 (time and pose) expected, {found} found"
                ))
            })?;
            (None, pose_from(matrix, path, place.clone())?)
        }
    };
    Ok(PoseRow { place, time_s, pose })
}

#[cfg(test)]
mod tests {
    use super::super::tests::Temp;
    use super::*;

    use glam::DVec3;

    const S: i64 = 1_000_000_000;

    #[test]
    fn rows_for_sweeps_and_for_times() {
        let t = Temp::new();
        let x = |name: &str, text: &str, stamps_ns: &[i64]| -> Vec<Option<f64>> {
            let poses = read(&t.write(name, text), stamps_ns).unwrap_or_else(|e| panic!("{e}"));
            let x = |p: Pose| (p.translation.x * 1e6).round() / 1e6;
            poses.into_iter().map(|p| p.map(x)).collect()
        };
        let kitti = "1 0 0 5 0 1 0 0 0 0 1 0\n1 0 0 6 0 1 0 0 0 0 1 0\n";
        assert_eq!(x("k.txt", kitti, &[0, S, 2 * S]), [Some(5.0), Some(6.0), None]);
        let tum = |from: f64| {
            let line = |n: u32| format!("{} {n} 0 0 0 0 0 1\n", from + 0.4 * f64::from(n));
            format!("# time x y z qx qy qz qw\n{}{}{}", line(0), line(1), line(2))
        };
        // Between two poses, at them, and beyond; with times of the clock and since the start.
        let stamps = [-S / 10, 0, S / 5, S * 4 / 5 + 1000, S];
        let expected = [None, Some(0.0), Some(0.5), Some(2.0), None];
        assert_eq!(x("t.txt", &tum(0.0), &stamps), expected);
        let since = 1_700_000_000;
        assert_eq!(x("t.txt", &tum(since as f64), &stamps.map(|ns| ns + since * S)), expected);
        // Of another clock: one per sweep.
        assert_eq!(x("t.txt", &tum(77.0), &[0, S, 2 * S]), [Some(0.0), Some(1.0), Some(2.0)]);
        let refused = |name: &str, text: &str, stamps_ns: &[i64]| {
            read(&t.write(name, text), stamps_ns).unwrap_err().to_string()
        };
        let what = refused("t.txt", &tum(77.0), &[0, S]);
        assert!(what.ends_with("t.txt: 3 poses at other times than the sweeps, expected 2"));
        assert!(refused("k.txt", kitti, &[0]).ends_with("k.txt: 2 poses, expected 1"));
        assert!(refused("k.txt", "", &[0]).ends_with("0 poses, expected 1"));
        let mixed = format!("{kitti}{}", tum(0.0));
        assert!(refused("m.txt", &mixed, &[0]).contains("line 4: some rows have a time"));
        assert!(refused("m.txt", "1 2 3", &[0]).contains("line 1: 12 numbers (a 3x4 matrix) or 8"));
        let skew = tum(0.0).replace("0 0 0 1", "0 0 0 0.5");
        assert!(refused("m.txt", &skew, &[0]).contains("does not have length 1"));
        assert!(refused("m.txt", &tum(f64::NAN), &[0]).contains("time of NaN s"));
    }

    #[test]
    fn rows_of_a_part_of_a_recording() {
        let t = Temp::new();
        let poses = [1.0, 2.0].map(|x| Pose { translation: DVec3::X * x, ..Pose::IDENTITY });
        for (first, expected) in [(0, [true, true, false, false]), (2, [false, false, true, true])]
        {
            let path = t.write("p.txt", pose_rows(first, &poses));
            let found = read(&path, &[0; 4]).unwrap();
            assert_eq!(found.iter().map(Option::is_some).collect::<Vec<_>>(), expected);
            assert_eq!(found[first + 1].unwrap().translation.x, 2.0);
        }
        for (first, words) in [("3", "2 poses, expected 1"), ("9", "expected 0"), ("x", "line 1: ")]
        {
            let text = pose_rows(2, &poses).replace("sweep: 2", &format!("sweep: {first}"));
            let e = read(&t.write("p.txt", text), &[0; 4]).unwrap_err().to_string();
            assert!(e.contains(words), "{e}");
        }
    }

    #[test]
    fn matrices_of_numpy() {
        let t = Temp::new();
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 4, 4), }";
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.as_bytes());
        for x in [0.0, 3.0] {
            let rows = [1., 0., 0., x, 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.0f64];
            file.extend(rows.iter().flat_map(|v| v.to_le_bytes()));
        }
        let poses = read(&t.write("poses.npy", file), &[0, 1]).unwrap();
        assert_eq!(poses[1].unwrap().translation.x, 3.0);
    }
}
