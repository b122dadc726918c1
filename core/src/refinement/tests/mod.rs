//! The refinement against naive oracles, and on clusters whose motion is known.

extern crate std;
mod cloud;
mod history;
mod motion;
mod odd;

use super::*;
use crate::encoder::layers::SCORES;
use crate::random::Random;
use crate::record::{Column, NONE, Proposal, pack_flow};
use crate::sweep::{Placed, Point};
use crate::team::Alone;
use crate::thinning::TakenPoints;
use raywake_simd::Simd;
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

const SIDE: usize = 63;
/// Height of the ground in the window, voxels: 1.73 m below the middle of level 7.
const GROUND: f32 = 7.5 - 1.73 / 0.3;

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
    fn add(&mut self, at: [f32; 3], sensor: u32) {
        self.points.push(Point { sensor, ..Point::default() });
        self.placed.push(Placed { at, offset_s: 0.0 });
        self.columns.push(column_of(at));
    }

    /// One return of the ground in every column.
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

    /// How many had no room, and which are apart from clusters.
    fn fill(&self, cloud: &mut Cloud) -> (usize, Vec<bool>) {
        let (mut apart, mut scratch) =
            (vec![false; self.points.len()], raywake_alloc_guard::boxed!(Scratch, Scratch::new()));
        let Returns { points, placed, columns } = self;
        let (corner, stamp_s) = ([0; 3], 0.0);
        let returns = SweepReturns { corner, stamp_s, points: all(points), placed, columns };
        (cloud.fill(&profile(), &scaled(), returns, &mut apart, &mut scratch), apart)
    }

    fn cloud(&self) -> Box<Cloud> {
        let mut cloud = raywake_alloc_guard::boxed!(Cloud, Cloud::new());
        self.fill(&mut cloud);
        cloud
    }
}

/// Places and sensors of the returns that are kept of a column.
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

/// A car: two sides of a box of 15 by 6 by 4.5 voxels, seen at places of its own in every sweep.
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
    let Returns { points, placed, columns } = returns;
    let (corner, stamp_s) = ([0; 3], n as f64 * 0.1);
    let mut apart = vec![false; points.len()];
    let returns = SweepReturns { corner, stamp_s, points: all(points), placed, columns };
    refinement.insert_cloud(profile, Simd::BASELINE, returns, &mut apart);
}

fn all(points: &[Point]) -> TakenPoints<'_> {
    TakenPoints::new(points, points.len())
}

fn no_flow() -> Vec<Flow> {
    vec![0; SIDE * SIDE]
}

/// Columns as rays leave them that end at the returns and pass everywhere else.
fn columns(returns: &Returns) -> Vec<Column> {
    let mut columns = vec![[0xffff, 0]; SIDE * SIDE];
    for (Placed { at, .. }, &c) in returns.placed.iter().zip(&returns.columns) {
        if c != NONE && (0.0..16.0).contains(&at[2]) {
            let level = at[2] as u32;
            let [masks, solid] = &mut columns[c as usize];
            *masks = *masks & !(1 << level) | 1 << (16 + level);
            *solid |= 1 << level;
        }
    }
    columns
}

fn run(refinement: &mut Refinement, pair: &[&Returns; 2], flows: &[Flow]) {
    run_knowing(refinement, pair, flows, None, &[]);
}

/// The same where every tracklet predicts a displacement.
fn run_expecting(
    refinement: &mut Refinement,
    pair: &[&Returns; 2],
    flows: &[Flow],
    expected: Option<[f32; 2]>,
) {
    run_knowing(refinement, pair, flows, expected, &[]);
}

/// The same with the encoder's scores.
fn run_knowing(
    refinement: &mut Refinement,
    pair: &[&Returns; 2],
    flows: &[Flow],
    expected: Option<[f32; 2]>,
    scores: &[ColumnScores],
) {
    let [before, now] = pair.map(columns);
    let perceived = Perceived {
        columns_before: &before,
        columns_now: &now,
        foreground: &[],
        marked: 0,
        rays: 0,
        flow: flows,
        proposal: &[] as &[Proposal],
    };
    let step = SweepUniform { side: SIDE as i32, ..SweepUniform::default() };
    refinement.run(&Alone, &step, &perceived, scores, |_| {
        expected.map(|by| Prediction { by, certainty: 3.0 })
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

/// What is found after some sweeps, the pair's two the last.
fn found_in(sweeps: &[Returns], flows: &[Flow]) -> Vec<Moved> {
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
    let [.., before, now] = sweeps else { panic!("two sweeps make a pair") };
    run(&mut refinement, &[before, now], flows);
    motions(&refinement)
}
