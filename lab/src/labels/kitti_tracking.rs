//! Labels of KITTI's tracking benchmark: `label_02/NNNN.txt` with `calib/NNNN.txt`.
//!
//! A line is a box: frame, id, type, truncation, occlusion, alpha, 4 numbers of the box in the
//! image, height, width, length, x, y, z of the centre of its bottom and `rotation_y`, both in the
//! rectified camera frame (x right, y down, z forward).

use super::gather::{Gather, LabelRow};
use super::{Error, Labels, View};
use glam::{DMat3, DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_io::source::{text, whole};
use std::path::Path;

/// Fields of a line; tracker results append a score.
const FIELDS: usize = 17;

/// Reads the labels at `path` with the calibration at `calib`; boxes are transformed to the
/// Velodyne's frame, regions named `DontCare` left out.
///
/// Fails if a file cannot be read, a line is not a box, or the calibration lacks a transform.
pub(super) fn read(path: &Path, calib: &Path) -> Result<Labels, Error> {
    let velodyne_from_camera = read_calib(calib)?;
    let text = whole::read_text(path)?;
    let mut gather = Gather::default();
    for (line, content) in text::lines(&text) {
        let fields: Vec<&str> = content.split_ascii_whitespace().collect();
        if fields.len() < FIELDS {
            let what = format!("{} fields, {FIELDS} expected", fields.len());
            return Err(Error::input(path, format!("line {line}"), what));
        }
        if fields[2] == "DontCare" {
            gather.leave_out("regions left out: DontCare");
            continue;
        }
        let bad = |n: usize| {
            let what = format!("field {}: `{}` is not a number", n + 1, fields[n]);
            Error::input(path, format!("line {line}"), what)
        };
        let frame = fields[0].parse().map_err(|_| bad(0))?;
        let mut numbers = [0.0; 7];
        for (n, number) in numbers.iter_mut().enumerate() {
            *number = fields[10 + n].parse().map_err(|_| bad(10 + n))?;
        }
        let [height, width, length, ..] = numbers;
        let pose = velodyne_from_camera * camera_from_box(&numbers);
        gather.add(&LabelRow {
            id: fields[1],
            class: fields[2],
            frame,
            size: [length, width, height],
            centre: pose.translation.to_array(),
            rotation: pose.rotation,
        });
    }
    Ok(gather.finish(View::Camera))
}

/// The box's frame, centred in it with x forward and z up, in the rectified camera's. NaN stays
/// NaN.
fn camera_from_box(&[height, _, _, x, y, z, rotation_y]: &[f64; 7]) -> Pose {
    let forward = DVec3::new(rotation_y.cos(), 0.0, -rotation_y.sin());
    let up = DVec3::NEG_Y;
    let axes = DMat3::from_cols(forward, up.cross(forward), up);
    Pose { rotation: DQuat::from_mat3(&axes), translation: DVec3::new(x, y - 0.5 * height, z) }
}

/// `velodyne_from_camera` for the rectified camera. Keys are accepted with and without a colon,
/// from the tracking and the object benchmark.
fn read_calib(path: &Path) -> Result<Pose, Error> {
    let text = whole::read_text(path)?;
    let [a, b, c, d, e, f, g, h, i] = keyed::<9>(path, &text, ["R_rect", "R0_rect"])?.1;
    let rectified = [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0];
    let (line, rows) = keyed::<12>(path, &text, ["Tr_velo_cam", "Tr_velo_to_cam"])?;
    let pose = |rows: &[f64; 12]| {
        let what = |_| "R_rect or Tr_velo_cam is not a rotation";
        Pose::from_rows(rows).map_err(|e| Error::input(path, format!("line {line}"), what(e)))
    };
    Ok((pose(&rectified)? * pose(&rows)?).inverse())
}

/// The numbers after one of two keys, with their line.
fn keyed<const N: usize>(
    path: &Path,
    text: &str,
    keys: [&str; 2],
) -> Result<(usize, [f64; N]), Error> {
    for (line, content) in text::lines(text) {
        let (key, rest) = content.split_once(char::is_whitespace).unwrap_or((content, ""));
        if keys.contains(&key.trim_end_matches(':')) {
            return Ok((line, text::exactly(path, line, rest)?));
        }
    }
    Err(Error::input(path, "", format!("has no line `{}`", keys[0])))
}

#[cfg(test)]
mod tests {
    use super::super::Kind;
    use super::*;
    use crate::scratch::Scratch;

    const CALIB: &str = "P0: 1 0 0 0 0 1 0 0 0 0 1 0\n\
        R_rect 1 0 0 0 1 0 0 0 1\n\
        Tr_velo_cam 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n";

    fn labels(t: &Scratch, text: &str) -> Result<Labels, Error> {
        read(&t.write("label_02/0000.txt", text), &t.write("calib/0000.txt", CALIB))
    }

    #[test]
    fn boxes_in_the_velodyne_frame() {
        let t = Scratch::new();
        let text = "0 -1 DontCare -1 -1 -10 1 2 3 4 -1 -1 -1 -1000 -1000 -1000 -10\n\
            0 7 Van 0 0 -1.8 1 2 3 4 2.0 1.8 4.4 -4.9 1.7 13.3 -1.5707963267948966\n\
            2 7 Van 0 0 -1.8 1 2 3 4 2.0 1.8 4.4 -4.9 1.7 13.3 0 0.99\n";
        let labels = labels(&t, text).unwrap();
        assert_eq!(labels.notes, ["1 regions left out: DontCare"]);
        let [track] = &labels.tracks[..] else { panic!("{labels:?}") };
        assert_eq!((track.kind, track.size, track.boxes.len()), (Kind::Van, [4.4, 1.8, 2.0], 2));
        // 13 m ahead and 5 m to the left; the box's bottom is 1.5 m below the Velodyne.
        let ahead = track.boxes[&0];
        assert!((ahead.translation - DVec3::new(13.0, 5.0, -0.5)).length() < 1e-9, "{ahead:?}");
        // The camera's z axis points straight ahead, its x axis to the right.
        assert!(ahead.yaw_rad().abs() < 1e-9);
        assert!((track.boxes[&2].yaw_rad() + 0.5 * std::f64::consts::PI).abs() < 1e-9);
        assert!((ahead.rotation * DVec3::Z - DVec3::Z).length() < 1e-9);
    }

    #[test]
    fn mistakes() {
        let t = Scratch::new();
        let refused = |text: &str| labels(&t, text).unwrap_err().to_string();
        assert!(refused("0 7 Van 0 0\n").ends_with("0000.txt, line 1: 5 fields, 17 expected"));
        let line = "0 7 Van 0 0 -1.8 1 2 3 4 2.0 1.8 4.4 -4.9 1.7 13.3 0";
        assert!(
            refused(&line.replace("4.4", "x")).contains("line 1: field 13: `x` is not a number")
        );
        assert!(refused(&line.replace("0 7", "-1 7")).contains("field 1: `-1` is not a number"));
        let notes = |text: &str| labels(&t, text).unwrap().notes.join("; ");
        assert!(notes(&line.replace("13.3", "nan")).contains("a NaN or infinite"));
        assert!(notes(&line.replace("4.4", "-1")).contains("length, width or height not positive"));
        let file = t.write("label_02/0000.txt", line);
        let calib =
            |text: &str| read(&file, &t.write("calib/0000.txt", text)).unwrap_err().to_string();
        assert!(calib("R_rect 1 0 0 0 1 0 0 0 1\n").ends_with("has no line `Tr_velo_cam`"));
        assert!(calib(&CALIB.replace("0.3", "")).contains("line 3: 12 numbers expected, 11"));
        assert!(calib(&CALIB.replace("0 -1 0 0.1", "0 -2 0 0.1")).contains("is not a rotation"));
        let colon = CALIB.replace("R_rect", "R0_rect:").replace("velo_cam", "velo_to_cam:");
        assert!(read(&file, &t.write("calib/0000.txt", colon)).is_ok());
    }
}
