//! The refinement against naive oracles and on clusters with known motion.

extern crate std;
mod bodies;
mod cloud;
mod cloud_ring;
mod history;
mod motion;
mod odd;
mod sightlines;
mod starts;

use super::cloud::{Cloud, DetailedCloud};
use super::cloud_detail::CloudDetail;
use super::scans::Target;
use super::*;
use crate::encoder::layers::SCORES;
use crate::params::Profile;
use crate::random::Random;
use crate::record::{NONE, pack_flow};
use crate::sensor_paths::SensorPaths;
use crate::sweep::{Placed, Point};
use crate::team::SingleThread;
use crate::thinning::TakenPoints;
use core::ops::Deref;
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

const SIDE: usize = 63;
/// Height of the ground in the window, voxels: 1.73 m below the middle of level 7.
const GROUND: f32 = 7.5 - 1.73 / 0.3;
/// Position of the sensors: beside the window, 1.8 m above the ground.
const EYE: [f32; 3] = [31.5, -20.0, GROUND + 6.0];

/// Nothing was seen before the pair.
static NO_HISTORY: History = History::new();
const SENSORS: SensorPaths = SensorPaths::at_rest([EYE; 2]);

fn profile() -> Profile {
    Profile { side: SIDE as u32, ..Profile::hdl64() }
}

fn scaled() -> Scaled {
    Scaled::new(&profile())
}

fn column_of(at: [f32; 3]) -> u32 {
    let inside = |v: f32| v >= 0.0 && v < SIDE as f32;
    if inside(at[0]) && inside(at[1]) { at[0] as u32 * SIDE as u32 + at[1] as u32 } else { NONE }
}

/// A sweep of returns: places in the window (voxels) and sensors.
#[derive(Clone, Default)]
struct Returns {
    points: Vec<Point>,
    placed: Vec<Placed>,
    columns: Vec<u32>,
}

impl Returns {
    /// The same plus rays from [`EYE`] that end beyond the window, if `beyond` accepts the end.
    fn in_sight(&self, beyond: impl Fn([f32; 3]) -> bool) -> Returns {
        let mut all = self.clone();
        for azimuth in -150..150 {
            for elevation in -40..20 {
                let (x, z) = ((0.007 * azimuth as f32).tan(), 0.012 * elevation as f32);
                let end = [EYE[0] + 100.0 * x, EYE[1] + 100.0, EYE[2] + 100.0 * z];
                if beyond(end) {
                    all.add(end, 0);
                }
            }
        }
        all
    }

    fn add(&mut self, at: [f32; 3], sensor: u32) {
        self.points.push(Point { sensor, ..Point::default() });
        self.placed.push(Placed { at, offset_s: 0.0 });
        self.columns.push(column_of(at));
    }

    /// One ground return in every column.
    fn ground(height: impl Fn(f32, f32) -> f32) -> Returns {
        let mut returns = Returns::default();
        for c in 0..SIDE * SIDE {
            let [x, y] = [(c / SIDE) as f32 + 0.5, (c % SIDE) as f32 + 0.5];
            returns.add([x, y, height(x, y)], 0);
        }
        returns
    }

    fn flat() -> Returns {
        Returns::ground(|_, _| GROUND)
    }

    fn of_sweep<'a>(
        &'a self,
        profile: &'a Profile,
        stamp_s: f64,
        sensors: &'a SensorPaths,
    ) -> SweepReturns<'a> {
        let Returns { points, placed, columns } = self;
        SweepReturns {
            profile,
            corner: [0; 3],
            stamp_s,
            points: all(points),
            placed,
            columns,
            sensors,
        }
    }

    /// Returns how many had no room and which are apart from clusters.
    fn fill(&self, kept: &mut Kept) -> (usize, Vec<bool>) {
        let (mut apart, mut scratch) =
            (vec![false; self.points.len()], raywake_alloc_guard::boxed!(Scratch, Scratch::new()));
        let (profile, scaled) = (profile(), scaled());
        let returns = self.of_sweep(&profile, 0.0, &SENSORS);
        let Kept { cloud, detail } = kept;
        (cloud.fill(detail, &SingleThread, &scaled, returns, &mut apart, &mut scratch), apart)
    }

    fn cloud(&self) -> Kept {
        let mut kept = Kept::new();
        self.fill(&mut kept);
        kept
    }
}

/// What is kept of a sweep.
struct Kept {
    cloud: Box<Cloud>,
    detail: Box<CloudDetail>,
}

impl Kept {
    fn new() -> Kept {
        Kept {
            cloud: raywake_alloc_guard::boxed!(Cloud, Cloud::new()),
            detail: raywake_alloc_guard::boxed!(CloudDetail, CloudDetail::new()),
        }
    }

    fn all(&self) -> DetailedCloud<'_> {
        DetailedCloud { cloud: &self.cloud, detail: &self.detail }
    }
}

impl Deref for Kept {
    type Target = Cloud;

    fn deref(&self) -> &Cloud {
        &self.cloud
    }
}

/// Places and sensors of the returns kept in a column.
fn kept(cloud: &Cloud, column: usize) -> Vec<([f32; 3], u32)> {
    cloud.column(column).map(|n| cloud.sample(n)).map(|s| (s.at, s.sensor)).collect()
}

fn all_kept(cloud: &Cloud) -> Vec<([f32; 3], u32)> {
    (0..SIDE * SIDE).flat_map(|c| kept(cloud, c)).collect()
}

/// Returns anywhere above flat ground, some beyond the window.
fn scattered(random: &mut Random, count: usize, height: f32) -> Returns {
    let mut returns = Returns::flat();
    for _ in 0..count {
        let [x, y] = [0; 2].map(|_| random.between(-2.0, SIDE as f32 + 2.0));
        returns.add([x, y, GROUND + random.between(0.0, height)], random.below(2) as u32);
    }
    returns
}

/// A car: two sides of a box of 15 by 6 by 4.5 voxels, sampled anew in every sweep.
struct Car {
    centre: [f32; 2],
    yaw: f32,
}

impl Car {
    fn add_to(&self, returns: &mut Returns, random: &mut Random) {
        let (sin, cos) = (self.yaw.sin(), self.yaw.cos());
        for n in 0..400 {
            let [x, y] = if n % 3 == 0 {
                [-7.5, random.between(-3.0, 3.0)]
            } else {
                [random.between(-7.5, 7.5), -3.0]
            };
            let z = GROUND + random.between(0.7, 4.5);
            let at = [self.centre[0] + cos * x - sin * y, self.centre[1] + sin * x + cos * y];
            returns.add([at[0], at[1], z], 0);
        }
    }
}

fn sweep_of(car: &Car, random: &mut Random) -> Returns {
    let mut returns = Returns::flat();
    car.add_to(&mut returns, random);
    returns
}

fn give(refinement: &mut Refinement, returns: &Returns, n: usize) {
    give_with(refinement, &profile(), returns, n);
}

fn give_with(refinement: &mut Refinement, profile: &Profile, returns: &Returns, n: usize) {
    give_seen(refinement, profile, &returns.in_sight(|_| true), &SENSORS, n);
}

/// The same with the given sensors, and no rays other than those of the returns.
fn give_seen(
    refinement: &mut Refinement,
    profile: &Profile,
    returns: &Returns,
    sensors: &SensorPaths,
    n: usize,
) {
    let mut apart = vec![false; returns.points.len()];
    let returns = returns.of_sweep(profile, n as f64 * 0.1, sensors);
    refinement.insert_cloud(&SingleThread, returns, &mut apart);
}

fn all(points: &[Point]) -> TakenPoints<'_> {
    TakenPoints::new(points, points.len())
}

fn no_flow() -> Vec<Flow> {
    vec![0; SIDE * SIDE]
}

fn run(refinement: &mut Refinement, flows: &[Flow]) {
    run_with_scores(refinement, flows, None, &[]);
}

/// The same with the encoder's scores, and every tracklet predicting the displacement `expected`,
/// if there is one.
fn run_with_scores(
    refinement: &mut Refinement,
    flows: &[Flow],
    expected: Option<[f32; 2]>,
    scores: &[ColumnScores],
) {
    let step = SweepUniform { side: SIDE as i32, ..SweepUniform::default() };
    refinement.run(&SingleThread, &step, flows, scores, |_| {
        expected.map(|by| Prediction { by, certainty: 3.0, probability: 1.0 })
    });
}

type Moved = Option<([f32; 2], [f32; 3])>;

/// How every column moved.
fn motions(refinement: &Refinement) -> Vec<Moved> {
    (0..SIDE * SIDE).map(|c| refinement.at(c as u32).map(|r| (r.by, r.covariance))).collect()
}

fn check_sane(found: &[Moved]) {
    for (by, [xx, xy, yy]) in found.iter().flatten() {
        assert!(by.iter().all(|v| v.is_finite()), "{by:?}");
        assert!(
            xx.is_finite() && yy.is_finite() && *xx > 0.0 && xx * yy > xy * xy,
            "{xx} {xy} {yy}"
        );
    }
}

/// What is found after some sweeps, the last two being the pair.
fn found_in(sweeps: &[Returns], flows: &[Flow]) -> Vec<Moved> {
    found_with_scores(sweeps, flows, &[])
}

/// The same with the encoder's scores.
fn found_with_scores(sweeps: &[Returns], flows: &[Flow], scores: &[ColumnScores]) -> Vec<Moved> {
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
    run_with_scores(&mut refinement, flows, None, scores);
    motions(&refinement)
}
