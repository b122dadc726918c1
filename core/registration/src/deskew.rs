//! Sweeps thinned for registration and moved to their stamp by the vehicle's motion.

use crate::compact;
use core::f64::consts::TAU;
use glam::DVec3;
use raywake_core::pose::Twist;
use raywake_core::sweep::{Point, Rig, Timing};

/// Side of the voxels that keep one return each, m. Not tuned separately.
pub const VOXEL_M: f64 = 0.4;
/// Returns nearer or farther than this are left out, m: near ones are often from the own vehicle,
/// far ones too sparse for normals.
const RANGE_M: [f64; 2] = [2.0, 100.0];

/// A return in the vehicle frame at its own time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimedPoint {
    /// Where it is, m.
    pub position: DVec3,
    /// Time after the stamp, s; zero if it need not be moved.
    pub time_s: f64,
    voxel: [i32; 3],
    order: u32,
}

impl From<DVec3> for TimedPoint {
    /// A point at the stamp.
    fn from(position: DVec3) -> TimedPoint {
        TimedPoint { position, ..TimedPoint::default() }
    }
}

impl TimedPoint {
    /// A return, at the time given by the rig.
    pub(crate) fn of(point: &Point, rig: &Rig) -> TimedPoint {
        let moves = rig.distorted && rig.timing != Timing::AtStamp;
        let time_s = if moves { time_s(rig, point) } else { 0.0 };
        TimedPoint { time_s, ..at(point).into() }
    }

    /// Whether a return is finite, within range and not on the own vehicle.
    pub(crate) fn is_usable(point: &Point, rig: &Rig) -> bool {
        // A non-finite distance is not within range.
        (RANGE_M[0]..RANGE_M[1]).contains(&at(point).length())
            && point.offset_s.is_finite()
            && !rig.is_own_vehicle(point.position)
    }

    /// Where the point was at the stamp, for a vehicle with this motion, m.
    pub fn at_stamp(&self, twist: &Twist) -> DVec3 {
        if self.time_s == 0.0 {
            self.position
        } else {
            twist.over(self.time_s).transform(self.position)
        }
    }
}

/// The returns of a sweep that registration uses, one per voxel: those that are finite, within
/// range and not on the own vehicle. `storage` should have room for as many as there are `points`;
/// those beyond its capacity are left out.
pub fn thin_sweep<'a>(
    points: &[Point],
    rig: &Rig,
    storage: &'a mut [TimedPoint],
) -> &'a mut [TimedPoint] {
    let usable = points.iter().filter(|p| TimedPoint::is_usable(p, rig));
    let count =
        storage.iter_mut().zip(usable).map(|(slot, p)| *slot = TimedPoint::of(p, rig)).count();
    thin(&mut storage[..count], VOXEL_M)
}

/// Moves the first point in every voxel of side `voxel_m` to the front, preserving their order, and
/// returns these. Non-finite points are left out.
///
/// A point rather than the mean: it keeps its time and lies on a surface.
pub fn thin(points: &mut [TimedPoint], voxel_m: f64) -> &mut [TimedPoint] {
    let finite = compact(points, |p| p.position.is_finite());
    let points = &mut points[..finite];
    for (order, p) in (0..).zip(points.iter_mut()) {
        p.voxel = (p.position / voxel_m).floor().to_array().map(|c| c as i32);
        p.order = order;
    }
    points.sort_unstable_by_key(|p| (p.voxel, p.order));
    let mut before = None;
    let kept = compact(points, |p| before.replace(p.voxel) != Some(p.voxel));
    points[..kept].sort_unstable_by_key(|p| p.order);
    &mut points[..kept]
}

/// Duration of one sweep, s; `None` if all returns are at the stamp.
pub fn span_s(rig: &Rig) -> Option<f64> {
    match rig.timing {
        Timing::AtStamp => None,
        Timing::Offset { span_s, .. } | Timing::Azimuth { span_s } => Some(span_s),
    }
}

fn at(point: &Point) -> DVec3 {
    DVec3::from_array(point.position.map(f64::from))
}

/// Time of a return after the stamp, s; [`Timing`] says how it is known. Unlike in the grid's
/// preparation it is not rounded to slots, within which a car moves by centimetres.
fn time_s(rig: &Rig, point: &Point) -> f64 {
    match rig.timing {
        Timing::AtStamp => 0.0,
        Timing::Offset { .. } => f64::from(point.offset_s),
        Timing::Azimuth { span_s } => {
            let p = at(point);
            -libm::atan2(p.y, p.x) / TAU * span_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::pose::Pose;
    use std::vec;
    use std::vec::Vec;

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

    fn thinned(points: &[Point], rig: &Rig) -> Vec<TimedPoint> {
        thin_sweep(points, rig, &mut vec![TimedPoint::default(); points.len()]).to_vec()
    }

    #[test]
    fn returns_move_by_their_time() {
        let twist = Twist { linear: DVec3::new(10.0, 0.0, 0.0), angular: DVec3::ZERO };
        let points = [point(20.0, 0.0, 0.01), point(0.0, 20.0, -0.02), point(-20.0, -0.01, 0.0)];
        let moved = |rig: &Rig| -> Vec<f64> {
            let moved = thinned(&points, rig).into_iter().map(|p| p.at_stamp(&twist).x);
            moved.map(|x| (x * 1e3).round() / 1e3).collect()
        };
        let mut rig = rig(Timing::Azimuth { span_s: 0.1 });
        // Left is a quarter revolution before the stamp, the rear's right side half of one after.
        assert_eq!(moved(&rig), [20.0, -0.25, -19.5]);
        rig.timing = Timing::Offset { from_s: -0.05, span_s: 0.1 };
        assert_eq!(moved(&rig), [20.1, -0.2, -20.0]);
        rig.distorted = false;
        assert_eq!(moved(&rig), [20.0, 0.0, -20.0]);
    }

    #[test]
    fn the_first_of_a_voxel_in_the_order_of_all() {
        let at =
            [DVec3::NAN, DVec3::splat(9.0), DVec3::ZERO, DVec3::splat(0.1), DVec3::splat(-1.0)];
        let mut points = at.map(TimedPoint::from);
        let kept: Vec<f64> = thin(&mut points, 0.5).iter().map(|p| p.position.x).collect();
        assert_eq!(kept, [9.0, 0.0, -1.0]);
    }

    #[test]
    fn unusable_returns() {
        let bad = [
            point(f32::NAN, 5.0, 0.0),
            point(f32::INFINITY, 5.0, 0.0),
            point(0.0, 0.0, 0.0),
            point(3.0, 0.0, 0.0),
            point(1e30, 0.0, 0.0),
            point(20.0, 0.0, f32::NAN),
        ];
        assert!(thinned(&bad, &rig(Timing::AtStamp)).is_empty());
    }
}
