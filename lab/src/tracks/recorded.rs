//! Labelled objects of a recorded drive.

use super::object::{Moment, Object, Seen, centroid, mark_passed_returns};
use crate::labels::{self, Labels, Motion, Track, Trajectory, trajectories, turn};
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::return_clock::ReturnClock;
use raywake_core::sweep::{Point, Rig};
use raywake_io::Error;
use raywake_io::source::{self, OpenOptions, Source, SweepData};
use std::path::Path;

/// How far boxes are extended beyond their sides, m.
const MARGIN_M: f64 = 0.15;

/// Returns below this height above a box's bottom count as ground, m.
const GROUND_M: f64 = 0.2;

/// Minimum number of returns per sweep, and of sweeps that have as many.
const BATCH_RETURNS: usize = 10;
const BATCHES: usize = 10;

/// The objects of a drive, and the labels of those that are parked, which wander in the world.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Parked ones.
    pub stationary: Vec<Object>,
    /// Moving ones; their truth is their smoothed labels.
    pub moving: Vec<Object>,
    /// Labels of the parked ones as given, in the same order.
    pub labels: Vec<Vec<Moment>>,
    /// Labelled tracks left out: seen too briefly or by too few returns, or neither parked nor
    /// moving throughout.
    pub left_out: usize,
}

/// The labelled objects of the drive at `path`: the returns in their boxes and above the ground, at
/// the time and from the origin of every return.
///
/// Fails if the drive or its labels cannot be read.
pub fn read(path: &Path) -> Result<Recorded, Error> {
    let mut source = source::open(path, &OpenOptions::default())?;
    let labels = labels::open(path, source.as_ref())?;
    let trajectories = trajectories(&labels, source.as_ref());
    let mut gathered: Vec<Gathered> = vec![Gathered::default(); labels.tracks.len()];
    let (clock, mut sweep) = (ReturnClock::new(), SweepData::default());
    for index in 0..source.len() {
        source.read(index, &mut sweep)?;
        gather(&clock, source.rig(), &sweep, &labels, &trajectories, &mut gathered);
    }
    let mut found =
        Recorded { stationary: Vec::new(), moving: Vec::new(), labels: Vec::new(), left_out: 0 };
    for ((track, trajectory), gathered) in labels.tracks.iter().zip(&trajectories).zip(gathered) {
        match object(source.as_ref(), track, trajectory, gathered) {
            Some((object, labelled)) if object.stationary => {
                found.stationary.push(object);
                found.labels.push(labelled);
            }
            Some((object, _)) => found.moving.push(object),
            None => found.left_out += 1,
        }
    }
    Ok(found)
}

/// Returns of a track, sweep by sweep.
type Gathered = Vec<Vec<Seen>>;

fn gather(
    clock: &ReturnClock,
    rig: &Rig,
    sweep: &SweepData,
    labels: &Labels,
    trajectories: &[Trajectory],
    gathered: &mut [Gathered],
) {
    let seen = |p| seen(clock, rig, sweep, p);
    let mut seen: Vec<Seen> = sweep.points.iter().filter_map(seen).collect();
    mark_passed_returns(&mut seen, |_| true);
    for ((track, trajectory), gathered) in labels.tracks.iter().zip(trajectories).zip(gathered) {
        let (Some(labelled), Some(state)) =
            (track.boxes.get(&sweep.frame), trajectory.at(sweep.frame))
        else {
            continue;
        };
        let world_from_box = sweep.world_from_vehicle * *labelled;
        let half = 0.5 * DVec3::from_array(track.size);
        let within = |s: &&Seen| {
            // The box moves until the return's time.
            let moved = state.velocity * (s.time_s - sweep.stamp_s);
            let at = world_from_box.inverse().transform(s.at - moved);
            let out = at.abs() - half;
            out.max_element() <= MARGIN_M && at.z > GROUND_M - half.z
        };
        let mut inside: Vec<Seen> = seen.iter().filter(within).copied().collect();
        if inside.len() >= BATCH_RETURNS {
            inside.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
            gathered.push(inside);
        }
    }
}

/// A return in the world, at its own time.
fn seen(clock: &ReturnClock, rig: &Rig, sweep: &SweepData, point: &Point) -> Option<Seen> {
    let at = DVec3::from_array(point.position.map(f64::from));
    let sensor = rig.sensors.get(point.sensor as usize)?;
    if !at.is_finite() || at == DVec3::ZERO {
        return None;
    }
    let offset_s = clock.offset_s(rig, point);
    let moved = sweep.world_from_vehicle * sweep.twist.over(offset_s);
    let place = if rig.distorted { moved } else { sweep.world_from_vehicle };
    let from = moved.transform(sensor.translation);
    let (at, time_s) = (place.transform(at), sweep.stamp_s + offset_s);
    Some(Seen { at, from, time_s, sensor: point.sensor as u8, passed: [false; 2] })
}

/// The object of a track and its labels as given; `None` if it is left out.
fn object(
    source: &dyn Source,
    track: &Track,
    trajectory: &Trajectory,
    gathered: Gathered,
) -> Option<(Object, Vec<Moment>)> {
    let states = trajectory.states();
    let all = |motion| states.iter().all(|s| s.motion == motion);
    let stationary = all(Motion::Parked);
    if gathered.len() < BATCHES || !stationary && !all(Motion::Moving) {
        return None;
    }
    let first = gathered[0][0];
    let (anchor, start_s) = (first.at.round(), first.time_s);
    let mut object = Object {
        name: format!("{}, track {}", source.name(), track.id),
        kind: track.kind,
        size: track.size,
        stationary,
        anchor,
        start_s,
        returns: Vec::new(),
        batches: Vec::new(),
        truth: Vec::new(),
    };
    for sweep in gathered {
        let from = object.returns.len();
        object.returns.extend(sweep.iter().map(|r| r.of_object(anchor, start_s)));
        object.batches.push(from..object.returns.len());
    }
    let smooth: Vec<_> = states.iter().map(|s| (s.stamp_s, s.world_from_box, s.velocity)).collect();
    object.truth = moments(&smooth, anchor, start_s);
    let raw = |s: &labels::trajectory::State| {
        (s.stamp_s, s.world_from_vehicle * track.boxes[&s.frame], DVec3::ZERO)
    };
    let raw: Vec<_> = states.iter().map(raw).collect();
    let labelled = moments(&raw, anchor, start_s);
    let last_s = centroid(&object.returns[object.batches.last()?.clone()]).0;
    let seen = |m: &Moment| (-0.1..last_s + 0.1).contains(&m.time_s);
    Some((object, labelled.into_iter().filter(seen).collect()))
}

/// Times, poses and velocities in the world as moments; turn rates are differences of headings.
fn moments(states: &[(f64, Pose, DVec3)], anchor: DVec3, start_s: f64) -> Vec<Moment> {
    let mut moments: Vec<Moment> = Vec::with_capacity(states.len());
    for (stamp_s, pose, velocity) in states {
        let yaw = pose.yaw_rad();
        let heading = moments.last().map_or(yaw, |m| m.heading + turn(m.heading, yaw));
        moments.push(Moment {
            time_s: stamp_s - start_s,
            position: pose.translation - anchor,
            heading,
            velocity: *velocity,
            turn_rate: 0.0,
        });
    }
    let last = moments.len().saturating_sub(1);
    let between = |n: usize| (moments[n.saturating_sub(1)], moments[(n + 1).min(last)]);
    let rate = |(a, b): (Moment, Moment)| (b.heading - a.heading) / (b.time_s - a.time_s);
    // A single moment determines no rate.
    let rates: Vec<f64> = (0..moments.len()).map(|n| rate(between(n))).collect();
    let turning =
        |(m, rate): (Moment, f64)| Moment { turn_rate: if last > 0 { rate } else { 0.0 }, ..m };
    moments.into_iter().zip(rates).map(turning).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::pose::Twist;
    use raywake_core::sweep::Timing;

    #[test]
    fn a_return_of_a_spinning_sensor_has_its_own_time_and_place() {
        let rig = Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing: Timing::Azimuth { span_s: 0.1 },
            distorted: true,
            ground_m: -1.73,
            own_vehicle: None,
        };
        let sweep = SweepData {
            stamp_s: 7.0,
            world_from_vehicle: Pose::planar(100.0, 0.0, 0.0, 0.0),
            twist: Twist { linear: DVec3::new(8.0, 0.0, 0.0), angular: DVec3::ZERO },
            ..SweepData::default()
        };
        let point = |position| Point { position, ..Point::default() };
        let clock = ReturnClock::new();
        // It rotates clockwise: the left comes a quarter of a revolution before the stamp.
        for ([x, y], early) in [([5.0, 0.0], 0.0), ([0.0, 5.0], 0.025), ([0.0, -5.0], -0.025)] {
            let Seen { at, from, time_s, .. } =
                seen(&clock, &rig, &sweep, &point([x, y, 0.0])).unwrap();
            assert!((time_s - 7.0 + early).abs() < 1e-9);
            assert!((from.x - (100.0 - 8.0 * early)).abs() < 1e-9);
            assert!((at - from - DVec3::new(f64::from(x), f64::from(y), 0.0)).length() < 1e-6);
        }
        assert!(seen(&clock, &rig, &sweep, &point([f32::NAN; 3])).is_none());
        assert!(seen(&clock, &rig, &sweep, &point([0.0; 3])).is_none());
    }

    #[test]
    #[ignore = "needs RAYWAKE_DATA"]
    fn the_objects_of_a_recorded_drive() {
        let data = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names a folder");
        let found = read(&Path::new(&data).join("kitti_raw_0005")).unwrap();
        println!("{} parked, {} moving", found.stationary.len(), found.moving.len());
        assert_eq!(found.stationary.len() + found.moving.len() + found.left_out, 15);
        for object in found.stationary.iter().chain(&found.moving) {
            let cloud = object.batches().map(centroid);
            println!(
                "{}: {:?}, {} returns, {:.1} s",
                object.name,
                object.kind,
                object.returns.len(),
                object.span_s()
            );
            for (time_s, at) in cloud {
                let really = super::super::object::moment_at(&object.truth, time_s);
                let off = really.project(at);
                let half = 0.5 * DVec3::from_array(object.size) + 0.5;
                assert!(off.abs().cmple(half).all(), "{}: {off} at {time_s} s", object.name);
            }
        }
    }
}
