//! Objects of simulated drives past parked and moving traffic.

use super::object::{Moment, Object, Seen, mark_passed_returns};
use crate::labels::{Kind, kind, turn};
use crate::simulate::truth::class_name;
use glam::DVec3;
use raywake_sim::{Drive, Ego, Options, PERIOD_S, Rng, SensorRig, SimSweep};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Sweeps of a drive.
const SWEEPS: usize = 100;

/// A track ends if fewer returns than this ...
const BATCH_RETURNS: usize = 20;
/// ... come in each of more than this many batches.
const GAP_BATCHES: usize = 5;

/// Minimum and maximum number of batches from the first to the last of an object: longer ones are
/// cut to those around the batch with most returns.
const BATCHES: [usize; 2] = [40, 65];

/// Minimum number of returns of an object.
const RETURNS: usize = 2000;

/// Minimum distance covered by a moving object, m.
const MOVED_M: f64 = 2.0;

/// Maximum number of parked objects from one drive, and of moving ones of a kind, so that they come
/// from many streets.
const PER_DRIVE: [usize; 2] = [6, 2];

/// Time between two samples of the truth, s.
const TRUTH_S: f64 = 0.01;

/// Half the time step of the difference quotient for velocities, s.
const STEP_S: f64 = 5e-4;

/// Maximum number of drives laid out.
const DRIVES_MAX: u64 = 400;

/// Drives to take objects from.
#[derive(Clone, Debug)]
pub struct Drives {
    /// Determines all of them.
    pub seed: u64,
    /// What sees the objects.
    pub rig: SensorRig,
}

/// Numbers of objects wanted.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Parked vehicles.
    pub parked: usize,
    /// Moving objects, by kind.
    pub moving: Vec<(Kind, usize)>,
}

impl Wanted {
    /// 52 parked vehicles and 60 moving objects of all kinds.
    pub fn full() -> Wanted {
        Wanted {
            parked: 52,
            moving: vec![
                (Kind::Car, 14),
                (Kind::Van, 7),
                (Kind::Truck, 6),
                (Kind::Bus, 5),
                (Kind::Tram, 5),
                (Kind::Motorcycle, 6),
                (Kind::Cyclist, 8),
                (Kind::Pedestrian, 9),
            ],
        }
    }

    fn is_satisfied(&self) -> bool {
        self.parked == 0 && self.moving.iter().all(|m| m.1 == 0)
    }

    /// Takes one off, parked or moving of a kind, if one is wanted.
    fn take(&mut self, moving: Option<Kind>) -> bool {
        let left = match moving {
            None => &mut self.parked,
            Some(kind) => match self.moving.iter_mut().find(|m| m.0 == kind) {
                Some(moving) => &mut moving.1,
                None => return false,
            },
        };
        let wanted = *left > 0;
        *left -= usize::from(wanted);
        wanted
    }

    /// Whether a drive may have an object that is wanted.
    fn may_have(&self, drive: &Drive) -> bool {
        let lacks = |kind| self.moving.iter().any(|m| m.0 == kind && m.1 > 0);
        let moves = |o: &raywake_sim::Object| !o.path.is_static() && lacks(of_class(o.class));
        self.parked > 0 || drive.scene().objects.iter().any(moves)
    }
}

/// The rule for choosing objects, for display.
pub fn rule() -> String {
    let ([least, most], [parked, of_a_kind]) = (BATCHES, PER_DRIVE);
    format!(
        "At least {RETURNS} returns, over the longest stretch of sweeps with at least \
         {BATCH_RETURNS} returns and no gap of more than {GAP_BATCHES} sweeps, which is at least \
         {least} sweeps long and cut to {most} around the sweep with most returns. Up to {parked} \
         parked vehicles from a drive and {of_a_kind} moving objects of a kind, which cover at \
         least {MOVED_M} m."
    )
}

fn of_class(class: raywake_sim::Class) -> Kind {
    kind(class_name(class)).unwrap_or(Kind::Other)
}

/// Objects of some drives, stationary and moving.
#[derive(Clone, Debug, PartialEq)]
pub struct Sets {
    /// Parked vehicles.
    pub stationary: Vec<Object>,
    /// Moving objects.
    pub moving: Vec<Object>,
}

/// Simulates drives until there are as many objects as wanted, the same on every run; or fewer if
/// [`DRIVES_MAX`] drives do not have them.
pub fn simulate(drives: &Drives, wanted: &Wanted) -> Sets {
    let mut wanted = wanted.clone();
    let mut sets = Sets { stationary: Vec::new(), moving: Vec::new() };
    for number in 0..DRIVES_MAX {
        if wanted.is_satisfied() {
            break;
        }
        let drive = drive(drives, number);
        if !wanted.may_have(&drive) {
            continue;
        }
        let [parked, of_a_kind] = PER_DRIVE;
        let mut taken = HashMap::new();
        for object in objects(&drive, number) {
            let (sort, set, most) = match object.stationary {
                true => (None, &mut sets.stationary, parked),
                false => (Some(object.kind), &mut sets.moving, of_a_kind),
            };
            let taken = taken.entry(sort).or_insert(0);
            if *taken < most && wanted.take(sort) {
                *taken += 1;
                set.push(object);
            }
        }
    }
    sets
}

/// Drive `number`: three in five go straight on, the others round a corner or stop and go.
fn drive(drives: &Drives, number: u64) -> Drive {
    let mut rng = Rng::split(drives.seed, number);
    let ego = match (rng.unit() * 5.0) as u32 {
        0..3 => Ego::Straight { speed: rng.range(4.0, 10.0) },
        3 => Ego::turn(&mut rng),
        _ => Ego::stop_and_go(&mut rng),
    };
    let rig = drives.rig.clone();
    let options = Options { sweeps: SWEEPS, ego, rig, ..Options::default() };
    Drive::new(rng.bits(), options)
}

/// All objects in a drive that are seen well and long enough, in the order of ids.
fn objects(drive: &Drive, number: u64) -> Vec<Object> {
    let mut seen: BTreeMap<u32, Vec<Seen>> = BTreeMap::new();
    for index in 0..drive.sweeps() {
        collect(drive, &drive.sweep(index), &mut seen);
    }
    let mut found = Vec::new();
    for (id, returns) in seen {
        let object = &drive.scene().objects[id as usize - 1];
        let stationary = object.path.is_static();
        let kind = of_class(object.class);
        if stationary && !matches!(kind, Kind::Car | Kind::Van | Kind::Truck) {
            continue;
        }
        let Some(window) = window(&returns) else { continue };
        let start_s = (window.start as f64 - 0.5) * PERIOD_S;
        let within = |r: &&Seen| window.contains(&batch(r.time_s));
        let returns: Vec<Seen> = returns.iter().filter(within).copied().collect();
        if returns.len() < RETURNS {
            continue;
        }
        let anchor = returns[0].at.round();
        let truth = truth(drive, id, anchor, start_s, window.len());
        let moved = (truth[truth.len() - 1].position - truth[0].position).length();
        if !stationary && moved < MOVED_M {
            continue;
        }
        found.push(Object {
            name: format!("drive {number}, object {id}"),
            kind,
            size: object.size,
            stationary,
            anchor,
            start_s,
            returns: returns.iter().map(|r| r.of_object(anchor, start_s)).collect(),
            batches: batches(&returns),
            truth,
        });
    }
    found
}

/// The batch, which is a sweep, that a time belongs to.
fn batch(time_s: f64) -> usize {
    (time_s / PERIOD_S + 0.5).max(0.0) as usize
}

fn batches(returns: &[Seen]) -> Vec<Range<usize>> {
    let mut batches = Vec::new();
    for same in returns.chunk_by(|a, b| batch(a.time_s) == batch(b.time_s)) {
        let from = batches.last().map_or(0, |b: &Range<usize>| b.end);
        batches.push(from..from + same.len());
    }
    batches
}

/// Adds the returns of a sweep, each placed in the world by the vehicle's pose at its own time.
fn collect(drive: &Drive, sweep: &SimSweep, seen: &mut BTreeMap<u32, Vec<Seen>>) {
    let rig = drive.rig();
    // All beams of a column have one time.
    let mut poses = HashMap::new();
    let mut all = Vec::with_capacity(sweep.points.len());
    for point in &sweep.points {
        let time_s = sweep.stamp_s + f64::from(point.offset_s);
        let pose = *poses
            .entry(point.offset_s.to_bits())
            .or_insert_with(|| drive.world_from_vehicle(time_s));
        let at = pose.transform(DVec3::from_array(point.position.map(f64::from)));
        let from = pose.transform(rig.sensors[point.sensor as usize].translation);
        all.push(Seen { at, from, time_s, sensor: point.sensor as u8, passed: [false; 2] });
    }
    mark_passed_returns(&mut all, |n| sweep.truth[n].object != 0);
    for (one, truth) in all.into_iter().zip(&sweep.truth) {
        if truth.object != 0 {
            seen.entry(truth.object).or_default().push(one);
        }
    }
}

/// The longest stretch of batches without a gap, cut to those around its fullest batch; `None` if
/// it is too short.
fn window(returns: &[Seen]) -> Option<Range<usize>> {
    let mut counts = [0; SWEEPS + 1];
    for r in returns {
        counts[batch(r.time_s).min(SWEEPS)] += 1;
    }
    let full: Vec<usize> = (0..SWEEPS).filter(|&b| counts[b] >= BATCH_RETURNS).collect();
    let stretches = full.chunk_by(|a, b| b - a <= GAP_BATCHES + 1);
    let longest = stretches.max_by_key(|s| s[s.len() - 1] - s[0])?;
    let (first, end) = (longest[0], longest[longest.len() - 1] + 1);
    let [least, most] = BATCHES;
    if end - first < least {
        return None;
    }
    let fullest = *longest.iter().max_by_key(|&&b| counts[b])?;
    let begin =
        fullest.saturating_sub(most / 2).max(first).min(end.saturating_sub(most).max(first));
    Some(begin..end.min(begin + most))
}

/// The true motion of an object from `start_s` on, over this many batches.
fn truth(drive: &Drive, id: u32, anchor: DVec3, start_s: f64, batches: usize) -> Vec<Moment> {
    let scene = drive.scene();
    let object = &scene.objects[id as usize - 1];
    let at = |t: f64| scene.world_from_street * object.pose(&scene.ground, t);
    let samples = (batches as f64 * PERIOD_S / TRUTH_S).round() as usize;
    let mut heading = at(start_s).yaw_rad();
    let moment = |n: usize| {
        let time_s = n as f64 * TRUTH_S;
        let t = start_s + time_s;
        let (here, [before, after]) = (at(t), [-STEP_S, STEP_S].map(|s| at(t + s)));
        heading += turn(heading, here.yaw_rad());
        let per_s = 0.5 / STEP_S;
        Moment {
            time_s,
            position: here.translation - anchor,
            heading,
            velocity: (after.translation - before.translation) * per_s,
            turn_rate: turn(before.yaw_rad(), after.yaw_rad()) * per_s,
        }
    };
    (0..=samples).map(moment).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::stamp_s;

    #[test]
    fn windows_are_centred_on_the_fullest_batch() {
        let seen = |batches: &[(usize, usize)]| -> Vec<Seen> {
            let of = |&(b, n): &(usize, usize)| {
                let (at, from, time_s) = (DVec3::ZERO, DVec3::ZERO, stamp_s(b));
                std::iter::repeat_n(Seen { at, from, time_s, sensor: 0, passed: [false; 2] }, n)
            };
            batches.iter().flat_map(of).collect()
        };
        let steady = |batches: Range<usize>| -> Vec<(usize, usize)> {
            batches.map(|b| (b, BATCH_RETURNS)).collect()
        };
        assert_eq!(window(&seen(&steady(3..42))), None);
        assert_eq!(window(&seen(&steady(3..43))), Some(3..43));
        let gap = |n| [steady(3..30), steady(30 + n..60)].concat();
        assert_eq!(window(&seen(&gap(GAP_BATCHES))), Some(3..60));
        assert_eq!(window(&seen(&gap(GAP_BATCHES + 1))), None);
        for (fullest, expected) in [(2, 0..65), (50, 18..83), (97, 35..100)] {
            let mut all = steady(0..100);
            all[fullest].1 += 1;
            assert_eq!(window(&seen(&all)), Some(expected));
        }
    }
}
