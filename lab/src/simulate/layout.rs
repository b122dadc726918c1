//! File names and formats of a KITTI raw recording.

use raywake_core::pose::Pose;
use std::fmt::Display;

/// The day of all simulated drives: one on which KITTI did not record.
pub const DATE: &str = "2000_01_01";

/// Start of every drive, ns since midnight.
const NOON_NS: i64 = 43_200_000_000_000;

/// Name of a drive's folder within that of its day.
pub fn drive_name(number: usize) -> String {
    format!("{DATE}_drive_{number:04}_sync")
}

/// Name of a frame's file.
pub fn frame_name(frame: usize, extension: &str) -> String {
    format!("{frame:010}.{extension}")
}

/// A line of `timestamps.txt`, `offset_s` after the stamp of a frame.
pub fn timestamp(frame: usize, offset_s: f64) -> String {
    let ns = NOON_NS + frame as i64 * 100_000_000 + (offset_s * 1e9).round() as i64;
    let (second, ns) = (ns.div_euclid(1_000_000_000), ns.rem_euclid(1_000_000_000));
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{} {hour:02}:{minute:02}:{second:02}.{ns:09}\n", DATE.replace('_', "-"))
}

/// Joins numbers with single spaces.
pub fn spaced<T: Display>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|v| v.to_string()).collect::<Vec<_>>().join(" ")
}

/// The nine numbers of a rotation, row by row.
pub fn rotation_rows(pose: &Pose) -> [f64; 9] {
    pose.matrix().transpose().to_cols_array()
}

/// The twelve numbers of `[R | t]`, row by row.
pub fn rows(pose: &Pose) -> [f64; 12] {
    let (r, t) = (rotation_rows(pose), pose.translation);
    [r[0], r[1], r[2], t.x, r[3], r[4], r[5], t.y, r[6], r[7], r[8], t.z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_times() {
        assert_eq!(drive_name(12), "2000_01_01_drive_0012_sync");
        assert_eq!(frame_name(7, "bin"), "0000000007.bin");
        assert_eq!(timestamp(0, -0.05), "2000-01-01 11:59:59.950000000\n");
        assert_eq!(timestamp(36_123, 0.0), "2000-01-01 13:00:12.300000000\n");
        let pose = Pose::planar(1.0, 2.0, 3.0, 0.5);
        let back = Pose::from_rows(&rows(&pose)).unwrap();
        assert!((back.yaw_rad() - 0.5).abs() < 1e-12 && back.translation == pose.translation);
    }
}
