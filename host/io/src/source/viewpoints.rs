//! Poses in the headers of PCD files, as in benchmarks of dynamic points in maps (KTH's DynamicMap
//! Benchmark, DUFOMap): the pose of the sensor, with the points in the world. Other files have the
//! points in the frame of the sensor; the farthest cloud shows which it is.

use std::path::PathBuf;

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::median::median;
use super::pcd;
use crate::Error;

/// The poses of some clouds, and whether their points are in the world; `None` if not all files
/// have one, or if all are the same.
pub(super) fn read(files: &[(u64, PathBuf)]) -> Result<Option<(Vec<Pose>, bool)>, Error> {
    let mut poses = Vec::with_capacity(files.len());
    for (_, path) in files {
        let Some(pose) = pcd::viewpoint(path)? else { return Ok(None) };
        poses.push(pose);
    }
    if poses.windows(2).all(|pair| pair[0] == pair[1]) {
        return Ok(None);
    }
    let away = |n: &usize| poses[*n].translation.length();
    let farthest = (0..poses.len()).max_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
    let mut points = Vec::new();
    pcd::read(&files[farthest].1, &mut points)?;
    // Points are densest around their sensor.
    let sensor = median_distance(&points, poses[farthest].translation);
    let in_world = sensor < median_distance(&points, DVec3::ZERO);
    Ok(Some((poses, in_world)))
}

/// Transforms points from the world to the frame of a pose.
pub(super) fn transform_from_world(points: &mut [Point], pose: &Pose) {
    let vehicle_from_world = pose.inverse();
    for point in points {
        let at = DVec3::from_array(point.position.map(f64::from));
        point.position = vehicle_from_world.transform(at).as_vec3().to_array();
    }
}

fn median_distance(points: &[Point], from: DVec3) -> f64 {
    let away = |p: &Point| DVec3::from_array(p.position.map(f64::from)).distance(from);
    let all = points.iter().map(away).filter(|d| d.is_finite()).collect();
    median(all, f64::total_cmp).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::Temp;
    use super::super::{OpenOptions, SweepData, Unlocated, open};

    /// A ring around the sensor, which drives along x and looks left.
    fn clouds(in_world: bool) -> Temp {
        let t = Temp::new();
        for n in 0..3 {
            let x = 20.0 * f64::from(n);
            let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 8\nHEIGHT 1";
            let half = 0.5f64.sqrt();
            let points: String = (0..8)
                .map(|k| {
                    let (s, c) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
                    let local = [5.0 * c + 1.0, 5.0 * s];
                    let world = [x - local[1], local[0]];
                    let [x, y] = if in_world { world } else { local };
                    format!("{x} {y} 0.5\n")
                })
                .collect();
            let text = format!("{head}\nVIEWPOINT {x} 0 0 {half} 0 0 {half}\nDATA ascii\n{points}");
            t.write(&format!("{n}.pcd"), text);
        }
        t
    }

    #[test]
    fn points_in_the_world_or_not() {
        let options =
            |unlocated| OpenOptions { unlocated, ground_m: Some(-1.0), ..Default::default() };
        let (mut sweeps, mut sweep) = (Vec::new(), SweepData::default());
        for in_world in [false, true] {
            let t = clouds(in_world);
            for unlocated in [Unlocated::Refuse, Unlocated::Always] {
                let mut source = open(t.path(), &options(unlocated)).unwrap();
                assert_eq!(source.is_located(), unlocated == Unlocated::Refuse);
                let note = if in_world { "are in the world" } else { "in the frame of the sensor" };
                assert!(source.notes().iter().any(|n| n.contains(note)), "{:?}", source.notes());
                source.read(2, &mut sweep).unwrap();
                sweeps.push(sweep.points.clone());
            }
            let source = open(t.path(), &options(Unlocated::Refuse)).unwrap();
            assert!((source.pose(2).translation.x - 40.0).abs() < 1e-9);
            assert!((source.pose(2).yaw_rad() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
            assert!(source.describe().ends_with("poses from VIEWPOINT"));
        }
        for points in &sweeps[1..] {
            for (a, b) in points.iter().zip(&sweeps[0]) {
                assert!(
                    (0..3).all(|n| (a.position[n] - b.position[n]).abs() < 1e-5),
                    "{a:?} {b:?}"
                );
            }
        }
        // One file without a pose: no poses.
        let t = clouds(false);
        t.write(
            "1.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n",
        );
        assert!(!open(t.path(), &options(Unlocated::Accept)).unwrap().is_located());
        t.write("1.pcd", "FIELDS x y z\nVIEWPOINT 0 0 0 2 0 0 0\nDATA ascii\n");
        let error =
            open(t.path(), &options(Unlocated::Accept)).map(|_| ()).unwrap_err().to_string();
        assert!(
            error.ends_with("1.pcd, line 2: the quaternion of the pose does not have length 1")
        );
    }
}
