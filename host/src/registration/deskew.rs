//! Sweeps thinned for registration, and moved to their stamp by the vehicle's motion.

use super::cloud::thin;
use glam::DVec3;
use raywake_core::pose::Twist;
use raywake_core::sweep::{Point, Rig, Timing};
use std::f64::consts::TAU;

/// Side of the voxels that keep one return each, m.
pub const VOXEL_M: f64 = 0.4;
/// Returns nearer or farther than this are left out, m: near ones are often of the own vehicle, far
/// ones too sparse for normals.
const RANGE_M: [f64; 2] = [2.0, 100.0];

/// Returns of a sweep that registration uses, in the vehicle frame at their own times.
pub struct Thinned {
    points: Vec<DVec3>,
    /// After the stamp, s; empty where nothing is to be moved.
    times_s: Vec<f64>,
}

impl Thinned {
    /// Of the returns that are finite, within range, and not on the own vehicle.
    pub fn new(points: &[Point], rig: &Rig) -> Thinned {
        let used: Vec<&Point> = points.iter().filter(|p| usable(p, rig)).collect();
        let kept = thin(used.iter().map(|p| at(p)), VOXEL_M);
        let moves = rig.distorted && rig.timing != Timing::AtStamp;
        Thinned {
            points: kept.iter().map(|n| at(used[*n])).collect(),
            times_s: match moves {
                true => kept.iter().map(|n| time_s(rig, used[*n])).collect(),
                false => Vec::new(),
            },
        }
    }

    /// The points where they were at the stamp, for a vehicle with this motion.
    pub fn at_stamp(&self, twist: &Twist) -> Vec<DVec3> {
        if self.times_s.is_empty() {
            return self.points.clone();
        }
        let moved = self.points.iter().zip(&self.times_s);
        moved.map(|(p, t)| twist.over(*t).transform(*p)).collect()
    }
}

/// Time of one sweep, where the rig tells.
pub fn span_s(rig: &Rig) -> Option<f64> {
    match rig.timing {
        Timing::AtStamp => None,
        Timing::Offset { span_s, .. } | Timing::Azimuth { span_s } => Some(span_s),
    }
}

fn at(point: &Point) -> DVec3 {
    DVec3::from_array(point.position.map(f64::from))
}

fn usable(point: &Point, rig: &Rig) -> bool {
    let p = point.position;
    let own = rig.own_vehicle.is_some_and(|[low, high]| {
        p[0] > low[0] && p[0] < high[0] && p[1] > low[1] && p[1] < high[1]
    });
    // A distance that is not finite is not within range.
    (RANGE_M[0]..RANGE_M[1]).contains(&at(point).length()) && point.offset_s.is_finite() && !own
}

/// Time of a return after the stamp, s; [`Timing`] says how it is known. In contrast to the grid's
/// preparation it is not rounded to slots, which are as long as a car takes for centimetres.
fn time_s(rig: &Rig, point: &Point) -> f64 {
    match rig.timing {
        Timing::AtStamp => 0.0,
        Timing::Offset { .. } => f64::from(point.offset_s),
        Timing::Azimuth { span_s } => {
            let p = at(point);
            -p.y.atan2(p.x) / TAU * span_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::pose::Pose;

    fn rig(timing: Timing) -> Rig {
        Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing,
            distorted: true,
            ground_m: -1.7,
            own_vehicle: Some([[-1.5, -1.75], [4.5, 1.75]]),
        }
    }

    fn point(x: f32, y: f32, offset_s: f32) -> Point {
        Point { position: [x, y, 0.0], offset_s, ..Point::default() }
    }

    #[test]
    fn returns_move_by_their_time() {
        let twist = Twist { linear: DVec3::new(10.0, 0.0, 0.0), angular: DVec3::ZERO };
        let points = [point(20.0, 0.0, 0.01), point(0.0, 20.0, -0.02), point(-20.0, -0.01, 0.0)];
        let moved = |rig: &Rig| -> Vec<f64> {
            let points = Thinned::new(&points, rig).at_stamp(&twist);
            points.iter().map(|p| (p.x * 1e3).round() / 1e3).collect()
        };
        let mut rig = rig(Timing::Azimuth { span_s: 0.1 });
        // Left is a quarter of a turn before the stamp, the rear's right side half a turn after it.
        assert_eq!(moved(&rig), [20.0, -0.25, -19.5]);
        rig.timing = Timing::Offset { from_s: -0.05, span_s: 0.1 };
        assert_eq!(moved(&rig), [20.1, -0.2, -20.0]);
        rig.distorted = false;
        assert_eq!(moved(&rig), [20.0, 0.0, -20.0]);
    }

    #[test]
    fn what_is_no_surrounding() {
        let bad = [
            point(f32::NAN, 5.0, 0.0),
            point(f32::INFINITY, 5.0, 0.0),
            point(0.0, 0.0, 0.0),
            point(3.0, 0.0, 0.0),
            point(1e30, 0.0, 0.0),
            point(20.0, 0.0, f32::NAN),
        ];
        assert!(Thinned::new(&bad, &rig(Timing::AtStamp)).points.is_empty());
    }
}
