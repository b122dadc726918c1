//! Poses and times: the rows of `poses.txt`, the lines of `times.txt` and `timestamps.txt`, and the
//! vehicle's trajectory that they form.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use raywake_core::continuity::ContinuityLimits;
use raywake_core::pose::{Pose, PoseError, Twist};

use super::{text, whole};
use crate::Error;

/// Interval between sweeps that is assumed if a source has no times, s.
pub(super) const INTERVAL_S: f64 = 0.1;

/// Stamp and pose of every sweep of a source.
#[derive(Clone, Debug, Default)]
pub struct PoseTrack {
    /// s, increasing.
    pub stamps_s: Vec<f64>,
    /// `world_from_vehicle` at the stamps; empty if the poses are unknown.
    pub poses: Vec<Pose>,
}

impl PoseTrack {
    /// Velocity at sweep `i`, in the vehicle frame at its stamp: from the step from the previous
    /// sweep, or from the step to the next if the former is not a continuous motion, as on the
    /// first sweep or after a jump. Between two jumps it is zero.
    pub fn twist(&self, i: usize) -> Twist {
        let steady = |a: usize, b: usize| {
            let dt_s = self.stamps_s[b] - self.stamps_s[a];
            ContinuityLimits::DEFAULT.broken(&self.poses[a], &self.poses[b], dt_s).is_none()
        };
        let other = match i {
            _ if i > 0 && steady(i - 1, i) => i - 1,
            _ if i + 1 < self.poses.len() && steady(i, i + 1) => i + 1,
            _ => return Twist::ZERO,
        };
        // Seen from sweep i, so that the result is along the axes at its own stamp.
        let here_from_other = self.poses[i].inverse() * self.poses[other];
        here_from_other.twist(self.stamps_s[other] - self.stamps_s[i])
    }

    /// Time from the first to the last sweep, s.
    pub fn duration_s(&self) -> f64 {
        match (self.stamps_s.first(), self.stamps_s.last()) {
            (Some(a), Some(b)) => b - a,
            _ => 0.0,
        }
    }
}

/// Fails if a stamp does not come after the previous one; `place(i)` names stamp `i`.
pub(super) fn check_rising(
    stamps_s: &[f64],
    path: &Path,
    place: impl Fn(usize) -> String,
) -> Result<(), Error> {
    for (i, pair) in stamps_s.windows(2).enumerate() {
        if pair[1] <= pair[0] {
            let how = if pair[1] == pair[0] { "equal to" } else { "before" };
            let what = format!("time {} s is {how} the one before it ({} s)", pair[1], pair[0]);
            return Err(Error::input(path, place(i + 1), what));
        }
    }
    Ok(())
}

/// Largest deviation of a quaternion's length from 1.
const UNIT_TOLERANCE: f64 = 1e-2;

/// A pose from a position and a quaternion x, y, z, w, or what is wrong with it.
pub fn rigid(place: [f64; 3], [x, y, z, w]: [f64; 4]) -> Result<Pose, &'static str> {
    let (rotation, place) = (DQuat::from_xyzw(x, y, z, w), DVec3::from_array(place));
    if !rotation.is_finite() || !place.is_finite() {
        return Err("a pose with a NaN or infinite number");
    }
    if (rotation.length() - 1.0).abs() > UNIT_TOLERANCE {
        return Err("the quaternion of the pose does not have length 1");
    }
    Ok(Pose::new(rotation, place))
}

/// A pose from 3x4 row-major numbers, or an error at `place`.
pub(super) fn pose_from(rows: &[f64; 12], path: &Path, place: String) -> Result<Pose, Error> {
    Pose::from_rows(rows).map_err(|e| {
        let what = match e {
            PoseError::NotFinite => "a pose with a NaN or infinite number",
            PoseError::NotRigid => "the 3x3 part of the pose is not a rotation",
        };
        Error::input(path, place, what)
    })
}

/// A pose as such a row: 3x4 numbers that parse to the same values.
pub fn pose_row(pose: &Pose) -> String {
    let (m, t) = (pose.matrix(), pose.translation);
    let rows = [0, 1, 2].map(|i| {
        let r = m.row(i);
        format!("{:?} {:?} {:?} {:?}", r.x, r.y, r.z, t[i])
    });
    rows.join(" ")
}

/// Reads `camera_from_velodyne`, the line `Tr:` of an odometry sequence's `calib.txt`.
pub(super) fn read_camera(path: &Path) -> Result<Pose, Error> {
    let text = whole::read_text(path)?;
    match text::keyed(path, &text, "Tr")? {
        Some((line, rows)) => pose_from(&rows, path, format!("line {line}")),
        None => Err(Error::input(path, "", "has no line `Tr:` (camera from Velodyne)")),
    }
}

/// Converts poses of the camera to poses of the Velodyne: `inv(Tr) * P * Tr`, so that the world is
/// the Velodyne frame if the poses' world is the camera frame.
pub(super) fn from_camera(poses: &mut [Pose], camera_from_velodyne: Pose) {
    let velodyne_from_camera = camera_from_velodyne.inverse();
    for pose in poses {
        *pose = velodyne_from_camera * *pose * camera_from_velodyne;
    }
}

/// Times of sweeps, s, and where they come from.
pub(super) struct Times {
    pub stamps_s: Vec<f64>,
    /// The file; `None` if 10 Hz was assumed.
    pub path: Option<PathBuf>,
}

/// The times of the sweeps with these frame numbers, from the first of `candidates` that exists,
/// otherwise at 10 Hz by frame number.
///
/// Lines are sweeps in order if their counts agree, otherwise line n + 1 is frame n: a KITTI drive
/// keeps the lines of sweeps it lacks. Fails if neither fits, and if times do not increase.
pub(super) fn read_times(candidates: &[PathBuf], frames: &[u64]) -> Result<Times, Error> {
    let Some(path) = candidates.iter().find(|p| p.is_file()) else {
        let first = frames.first().copied().unwrap_or(0);
        let stamps_s = frames.iter().map(|f| (f - first) as f64 * INTERVAL_S).collect();
        return Ok(Times { stamps_s, path: None });
    };
    let all = read_stamps(path)?;
    let chosen = choose(&all, frames, path)?;
    let stamps_s: Vec<f64> = chosen.iter().map(|&(_, s)| s).collect();
    check_rising(&stamps_s, path, |i| format!("line {}", chosen[i].0))?;
    Ok(Times { stamps_s, path: Some(path.clone()) })
}

/// The lines that belong to `frames`: (line number, s).
fn choose(all: &[(usize, f64)], frames: &[u64], path: &Path) -> Result<Vec<(usize, f64)>, Error> {
    if all.len() == frames.len() {
        return Ok(all.to_vec());
    }
    let by_number: Option<Vec<_>> =
        frames.iter().map(|&f| usize::try_from(f).ok().and_then(|f| all.get(f).copied())).collect();
    by_number.ok_or_else(|| {
        let last = frames.last().copied().unwrap_or(0);
        let what =
            format!("{} times for {} sweeps, and none for frame {last}", all.len(), frames.len());
        Error::input(path, "", what)
    })
}

/// Every time in a file, with its line: seconds, or dates as seconds since the first date.
fn read_stamps(path: &Path) -> Result<Vec<(usize, f64)>, Error> {
    let text = whole::read_text(path)?;
    let mut first_ns = None;
    let mut stamps = Vec::new();
    for (line, content) in text::lines(&text) {
        let stamp = if content.contains(':') {
            let ns = date_ns(content).ok_or_else(|| {
                Error::input(path, format!("line {line}"), format!("`{content}` is not a date"))
            })?;
            // Differences in whole nanoseconds: a double of seconds since 1970 resolves 0.2 us.
            (ns - *first_ns.get_or_insert(ns)) as f64 * 1e-9
        } else {
            text::exactly::<1>(path, line, content)?[0]
        };
        if !stamp.is_finite() {
            return Err(Error::input(path, format!("line {line}"), "the time is not finite"));
        }
        stamps.push((line, stamp));
    }
    Ok(stamps)
}

/// Nanoseconds since 1970 of `2011-09-26 13:02:25.951199337`.
fn date_ns(text: &str) -> Option<i64> {
    let (date, time) = text.split_once(' ')?;
    let mut fields = date.splitn(3, '-').map(|w| w.parse::<i64>().ok());
    let (year, month, day) = (fields.next()??, fields.next()??, fields.next()??);
    let mut fields = time.splitn(3, ':');
    let hour: i64 = fields.next()?.parse().ok()?;
    let minute: i64 = fields.next()?.parse().ok()?;
    let (second, fraction) = fields.next().map(|s| s.split_once('.').unwrap_or((s, "")))?;
    let second: i64 = second.parse().ok()?;
    let within = |v: i64, low: i64, high: i64| (low..=high).contains(&v);
    let sensible = within(year, 1970, 2200)
        && within(month, 1, 12)
        && within(day, 1, 31)
        && within(hour, 0, 23)
        && within(minute, 0, 59)
        && within(second, 0, 60);
    if !sensible || fraction.len() > 9 || !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let ns: i64 = format!("{fraction:0<9}").parse().ok()?;
    let seconds = days(year, month, day) * 86_400 + hour * 3600 + minute * 60 + second;
    Some(seconds * 1_000_000_000 + ns)
}

/// Days since 1970-01-01 in the Gregorian calendar, counted in years that begin in March so that
/// the leap day comes last.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let y = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (y.div_euclid(400), y.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// A pure translation.
pub(super) fn shift(translation: DVec3) -> Pose {
    Pose { translation, ..Pose::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        assert_eq!(date_ns("1970-01-01 00:00:00"), Some(0));
        assert_eq!(date_ns("2011-09-26 13:02:25.951199337"), Some(1_317_042_145_951_199_337));
        assert_eq!(date_ns("2000-02-29 00:00:00.5"), Some(951_782_400_500_000_000));
        for bad in ["", "2011-09-26", "2011-13-26 13:02:25", "2011-09-26 13:02:2x", "a b:c:d"] {
            assert_eq!(date_ns(bad), None, "{bad}");
        }
    }

    #[test]
    fn twist_is_along_the_axes_at_the_sweep() {
        // A left turn at 1 rad/s while driving 10 m/s forward.
        let step = Pose::planar(1.0, 0.0, 0.0, 0.1);
        let poses = vec![Pose::planar(5.0, 5.0, 0.0, 2.0), Pose::planar(5.0, 5.0, 0.0, 2.0) * step];
        let track = PoseTrack { stamps_s: vec![0.0, 0.1], poses };
        let (first, second) = (track.twist(0), track.twist(1));
        assert!((first.linear - DVec3::new(10.0, 0.0, 0.0)).length() < 1e-9);
        assert!((first.angular.z - 1.0).abs() < 1e-9 && (second.angular.z - 1.0).abs() < 1e-9);
        // Going back from the second sweep must lead to the first one.
        let back = second.over(-0.1);
        assert!((back * step).translation.length() < 1e-9);
        assert_eq!(PoseTrack { stamps_s: vec![0.0], poses: vec![step] }.twist(0), Twist::ZERO);
    }

    #[test]
    fn camera_poses() {
        let tr = Pose::from_rows(&[0.0, -1.0, 0.0, 0.1, 0.0, 0.0, -1.0, 0.2, 1.0, 0.0, 0.0, 0.3])
            .unwrap();
        // The camera moves 2 m along its own z axis: the Velodyne moves 2 m along x.
        let mut poses = [shift(DVec3::new(0.0, 0.0, 2.0))];
        from_camera(&mut poses, tr);
        assert!((poses[0].translation - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-12);
    }
}
