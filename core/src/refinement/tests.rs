//! The refinement against naive oracles, and on things whose motion is known.

extern crate std;
use super::*;
use crate::params::CLOUD_MAX;
use crate::random::Random;
use crate::record::{Column, Proposal, flow};
use crate::team::Alone;
use std::boxed::Box;
use std::collections::{BTreeMap, BTreeSet};
use std::vec;
use std::vec::Vec;

const SIDE: usize = 63;
/// Height of the ground in the window, voxels: 1.73 m below the middle of level 7.
const GROUND: f32 = 7.5 - 1.73 / 0.3;

fn profile() -> Profile {
    Profile { side: SIDE as u32, ..Profile::hdl64() }
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

    /// How many had no room, and which are apart from things.
    fn fill(&self, cloud: &mut Cloud) -> (usize, Vec<bool>) {
        let (mut apart, mut scratch) = (vec![false; self.points.len()], Box::new(Scratch::new()));
        let Returns { points, placed, columns } = self;
        (cloud.fill(&profile(), points, placed, columns, &mut apart, &mut scratch), apart)
    }

    fn cloud(&self) -> Box<Cloud> {
        let mut cloud = Box::new(Cloud::new());
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

#[test]
fn nearest_is_the_nearest() {
    let mut random = Random(1);
    for count in [300, 3000, 12000] {
        let cloud = scattered(&mut random, count, 6.0).cloud();
        let all = all_kept(&cloud);
        let mut found = 0;
        for n in 0..4000 {
            // A third along each border.
            let mut at = [0; 2].map(|_| random.between(-1.5, SIDE as f32 + 1.5));
            if n % 3 > 0 {
                at[n / 3 % 2] = [-1.0, SIDE as f32 - 1.0][n % 3 - 1] + random.between(-0.5, 1.5);
            }
            let at = [at[0], at[1], GROUND + random.between(0.0, 6.0)];
            let sensor = random.below(2) as u32;
            let distance = |p: [f32; 3]| {
                let d = [p[0] - at[0], p[1] - at[1], p[2] - at[2]];
                d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
            };
            let of_sensor = all.iter().filter(|r| r.1 == sensor);
            let least = of_sensor.map(|r| distance(r.0)).fold(f32::INFINITY, f32::min);
            match cloud.nearest(at, sensor, 0.0) {
                Some((d2, p)) => {
                    assert!(d2 == least && distance(p.at) == d2, "{at:?}: {d2}, not {least}");
                    assert!(all[p.index as usize] == (p.at, sensor) && p.sensor == sensor);
                    found += 1;
                }
                None => assert!(least >= 1.0, "{at:?}: missed {least}"),
            }
        }
        assert!((20..3990).contains(&found), "{found}");
    }
}

#[test]
fn of_each_part_of_a_voxel_the_first_return_stays() {
    let mut random = Random(2);
    let mut returns = Returns::flat();
    for _ in 0..20_000 {
        let [x, y] = [0; 2].map(|_| random.between(10.0, 20.0));
        returns.add([x, y, GROUND + random.between(0.0, 16.0)], random.below(2) as u32);
    }
    let cloud = returns.cloud();
    let mut first = BTreeMap::new();
    for (n, [x, y, z]) in returns.placed.iter().map(|p| p.at).enumerate() {
        let height = z - GROUND;
        if (cloud::GROUND_HEIGHT..14.0).contains(&height) {
            let part = |v: f32| (v.fract() * 3.0) as u32;
            let key = (returns.columns[n], returns.points[n].sensor);
            let part = ((height * 3.0) as u32, part(x), part(y));
            first.entry((key, part)).or_insert(n);
        }
    }
    let mut wanted: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (((column, sensor), _), n) in first {
        wanted.entry((column, sensor)).or_default().push(n);
    }
    let mut total = 0;
    for column in 0..SIDE * SIDE {
        let mut expected = Vec::new();
        for sensor in 0..2 {
            let list = wanted.remove(&(column as u32, sensor)).unwrap_or_default();
            let list = list.into_iter().collect::<BTreeSet<_>>();
            expected.extend(list.iter().map(|n| (returns.placed[*n].at, sensor)));
        }
        let found = kept(&cloud, column);
        assert_eq!(found, expected, "column {column}");
        total += found.len();
    }
    assert!((5_000..19_000).contains(&total), "{total}");
}

#[test]
fn returns_beyond_the_capacity_are_counted() {
    // The middle of every part of a voxel, in an order of no meaning.
    let mut parts = Vec::new();
    for column in (0..SIDE * SIDE).step_by(7) {
        for n in 0..9 * 20 {
            let part = |n: usize| (n as f32 + 0.5) / 3.0;
            let [x, y] =
                [(column / SIDE) as f32 + part(n / 3 % 3), (column % SIDE) as f32 + part(n % 3)];
            parts.push([x, y, GROUND + 1.0 + part(n / 9)]);
        }
    }
    let mut random = Random(3);
    for n in (1..parts.len()).rev() {
        parts.swap(n, random.below(n + 1));
    }
    let mut returns = Returns::flat();
    parts.iter().for_each(|p| returns.add(*p, 0));
    let mut cloud = Box::new(Cloud::new());
    let (dropped, _) = returns.fill(&mut cloud);
    assert_eq!(dropped, parts.len() - CLOUD_MAX);
    assert!(dropped > 20_000);
    let all = all_kept(&cloud);
    assert_eq!(all.len(), CLOUD_MAX);
    // Those of the last columns go.
    let in_column = |p: &[f32; 3], c: u32| column_of(*p) < c;
    let last = column_of(all[CLOUD_MAX - 1].0);
    let before = parts.iter().filter(|p| in_column(p, last)).count();
    assert!(
        before <= CLOUD_MAX && parts.iter().filter(|p| in_column(p, last + 1)).count() >= CLOUD_MAX
    );
    // The same again, whatever the cloud held.
    assert_eq!(returns.fill(&mut cloud).0, dropped);
    assert!(all == all_kept(&cloud));
    // And it can be worked with.
    let mut refinement = Box::new(Refinement::new());
    for n in 0..3 {
        give(&mut refinement, &returns, n);
    }
    run(&mut refinement, &[&returns, &returns], &no_flow());
    assert_eq!(motions(&refinement), vec![None; SIDE * SIDE]);
}

#[test]
fn segments_are_what_a_flood_fill_reaches() {
    let mut random = Random(4);
    for density in [100, 500, 1500] {
        let mut returns = Returns::flat();
        for _ in 0..density {
            let [x, y] = [0; 2].map(|_| random.between(0.0, SIDE as f32));
            returns.add([x, y, GROUND + random.between(0.7, 13.9)], 0);
        }
        let cloud = returns.cloud();
        let flows: Vec<Flow> = (0..SIDE * SIDE)
            .map(|_| if random.below(2) == 0 { 0 } else { flow([random.below(5) as i32, 0]) })
            .collect();
        let excluded = random.below(SIDE * SIDE);
        let part = |c: usize| c != excluded && cloud.levels(c) != 0;
        let mut segments = Box::new(Segments::new());
        segments.find(&cloud, part, |c| flows[c]);
        let touch = |a: usize, b: usize| {
            let apart =
                |l: usize| (0..14).any(|m| cloud.levels(b) >> m & 1 != 0 && l.abs_diff(m) <= 2);
            let near = (0..14).any(|l| cloud.levels(a) >> l & 1 != 0 && apart(l));
            let differ = (flow_displacement(flows[a])[0] - flow_displacement(flows[b])[0]).abs();
            near && (flows[a] & flows[b] & VALID == 0 || differ <= 2)
        };
        let mut seen = BTreeSet::new();
        let mut wanted = Vec::new();
        for c in (0..SIDE * SIDE).filter(|c| part(*c)) {
            let mut reached = BTreeSet::new();
            let mut open = vec![c];
            while let Some(c) = open.pop().filter(|c| !seen.contains(c)) {
                if !seen.insert(c) {
                    continue;
                }
                reached.insert(c as u32);
                for other in (0..SIDE * SIDE).filter(|o| part(*o)) {
                    let beside = (c / SIDE).abs_diff(other / SIDE) <= 1
                        && (c % SIDE).abs_diff(other % SIDE) <= 1;
                    if beside && !seen.contains(&other) && touch(c, other) {
                        open.push(other);
                    }
                }
                open.retain(|o| !seen.contains(o));
            }
            if !reached.is_empty() {
                wanted.push(reached.into_iter().collect::<Vec<_>>());
            }
        }
        let found: Vec<_> = (0..segments.len()).map(|n| segments.columns(n).to_vec()).collect();
        assert_eq!(found, wanted);
        assert!(found.len() > 1);
    }
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
    let mut apart = vec![false; points.len()];
    refinement.take(profile, [0; 3], n as f64 * 0.1, points, placed, columns, &mut apart);
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
    run_expecting(refinement, pair, flows, None);
}

/// The same where every tracklet predicts a displacement.
fn run_expecting(
    refinement: &mut Refinement,
    pair: &[&Returns; 2],
    flows: &[Flow],
    expected: Option<[f32; 2]>,
) {
    let [before, now] = pair.map(columns);
    let perceived = Perceived {
        before: &before,
        now: &now,
        foreground: &[],
        marked: 0,
        rays: 0,
        state: flows,
        proposal: &[] as &[Proposal],
    };
    let step = Step { side: SIDE as i32, ..Step::default() };
    refinement.run(&Alone, &step, &perceived, |_| expected);
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

/// What is found of a car that moves steadily, over some sweeps: columns of it that move, the median
/// and the largest error of their motion, voxels.
fn error_of_steady(sweeps: u32, by: [f32; 2], turn: f32, seed: u64) -> (usize, f32, f32) {
    let mut random = Random(seed);
    let start = [0; 2].map(|_| random.between(27.0, 36.0));
    let yaw = random.between(-3.0, 3.0);
    let at = |n: f32| Car { centre: [0, 1].map(|a| start[a] + n * by[a]), yaw: yaw + n * turn };
    let profile = Profile { refinement_sweeps: sweeps, ..profile() };
    let all: Vec<Returns> = (0..3).map(|n| sweep_of(&at(n as f32 - 1.0), &mut random)).collect();
    let mut refinement = Box::new(Refinement::new());
    all.iter().enumerate().for_each(|(n, r)| give_with(&mut refinement, &profile, r, n));
    run(&mut refinement, &[&all[1], &all[2]], &no_flow());
    let found = motions(&refinement);
    check_sane(&found);
    let mut errors = Vec::new();
    for (c, found) in found.iter().enumerate() {
        let Some((moved, _)) = found else { continue };
        let [x, y] = [(c / SIDE) as f32 + 0.5 - start[0], (c % SIDE) as f32 + 0.5 - start[1]];
        let truth = [
            by[0] + turn.cos() * x - turn.sin() * y - x,
            by[1] + turn.sin() * x + turn.cos() * y - y,
        ];
        errors.push((moved[0] - truth[0]).hypot(moved[1] - truth[1]));
    }
    errors.sort_by(f32::total_cmp);
    match errors.len() {
        0 => (0, f32::INFINITY, f32::INFINITY),
        n => (n, errors[n / 2], errors[n - 1]),
    }
}

#[test]
fn cars_move_by_fractions_of_a_voxel() {
    // Measured: at most 0.015 and 0.02 voxels, 5 mm.
    for sweeps in [2, 3] {
        for n in 0..16 {
            let direction = n as f32 * std::f32::consts::TAU / 16.0;
            for distance in [0.4, 0.9, 2.6, 5.3] {
                for turn in [0.0, 0.02] {
                    let by = [distance * direction.cos(), distance * direction.sin()];
                    let (count, median, most) = error_of_steady(sweeps, by, turn, n + 100);
                    let case = std::format!("{sweeps} sweeps, {by:?}, {turn} rad");
                    assert!(count >= 15, "{case}: {count} columns move");
                    assert!(median < 0.03 && most < 0.04, "{case}: {median} {most}");
                }
            }
        }
    }
}

#[test]
fn what_is_seen_later_has_moved_for_longer() {
    // Seen 4 ms later in every sweep, as one that is overtaken.
    let late = 0.004;
    for n in 0..16 {
        let mut random = Random(300 + n);
        let direction = n as f32 * std::f32::consts::TAU / 16.0;
        let by = [4.0 * direction.cos(), 4.0 * direction.sin()];
        let sweep = |n: usize| {
            let shown = (n as f32 - 1.0) * (1.0 + late / 0.1);
            let at = [0, 1].map(|a| 31.0 + shown * by[a]);
            let mut returns = sweep_of(&Car { centre: at, yaw: direction }, &mut random);
            returns.placed.iter_mut().for_each(|p| p.offset_s = n as f32 * late);
            returns
        };
        let sweeps: Vec<Returns> = (0..3).map(sweep).collect();
        let found = found_in(&sweeps, &vec![flow(by.map(|v| v.round() as i32)); SIDE * SIDE]);
        check_sane(&found);
        let moved: Vec<_> = found.iter().flatten().map(|m| m.0).collect();
        assert!(moved.len() >= 15, "{n}: {}", moved.len());
        for m in moved {
            // As seen it would be 0.16.
            assert!((m[0] - by[0]).hypot(m[1] - by[1]) < 0.04, "{n}: {m:?}, not {by:?}");
        }
    }
}

#[test]
fn what_stands_is_exactly_still() {
    let mut random = Random(5);
    for n in 0..30 {
        let car = Car { centre: [30.0 + 0.1 * n as f32, 31.0], yaw: 0.2 * n as f32 };
        let all: Vec<Returns> = (0..3).map(|_| sweep_of(&car, &mut random)).collect();
        let mut refinement = Box::new(Refinement::new());
        all.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
        // Whatever energy minimisation made of it.
        let wrong = vec![flow([random.below(7) as i32 - 3, 1]); SIDE * SIDE];
        run(&mut refinement, &[&all[1], &all[2]], &wrong);
        assert!(motions(&refinement).iter().all(Option::is_none), "{n}");
    }
}

/// What is found after some sweeps, the pair's two the last.
fn found_in(sweeps: &[Returns], flows: &[Flow]) -> Vec<Moved> {
    let mut refinement = Box::new(Refinement::new());
    sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
    let [.., before, now] = sweeps else { panic!("two sweeps make a pair") };
    run(&mut refinement, &[before, now], flows);
    motions(&refinement)
}

#[test]
fn few_returns_move_nothing_by_themselves() {
    for count in 0..5 {
        let thing = |n: usize| {
            let mut returns = Returns::flat();
            for k in 0..count {
                let x = 20.5 + 1.1 * n as f32;
                returns.add([x, 30.1 + 0.4 * k as f32, GROUND + 1.2], 0);
            }
            returns
        };
        let sweeps: Vec<Returns> = (0..3).map(thing).collect();
        let flows = vec![flow([1, 0]); SIDE * SIDE];
        assert!(found_in(&sweeps, &flows).iter().all(Option::is_none), "{count}");
    }
}

#[test]
fn a_wall_that_seems_to_move_stands() {
    // Longer than anything that moves, with a pattern that does.
    let big = Profile { side: 167, ..Profile::hdl64() };
    let wall = |n: usize| {
        let mut returns = Returns::default();
        for k in 0..4 * 160 {
            let along = 2.0 + 0.25 * k as f32;
            if (k / 40 + n).is_multiple_of(2) {
                returns.add([along, 40.3, GROUND + 1.5], 0);
            }
            returns.add([along, 40.3, GROUND + 3.0], 0);
        }
        for placed in &returns.placed {
            assert!(placed.at[0] < 167.0);
        }
        let column = |placed: &Placed| placed.at[0] as u32 * 167 + placed.at[1] as u32;
        returns.columns = returns.placed.iter().map(column).collect();
        for c in 0..167 * 167 {
            let [x, y] = [(c / 167) as f32 + 0.5, (c % 167) as f32 + 0.5];
            returns.points.push(Point::default());
            returns.placed.push(Placed { at: [x, y, GROUND], offset_s: 0.0 });
            returns.columns.push(c);
        }
        returns
    };
    let mut refinement = Box::new(Refinement::new());
    let sweeps: Vec<Returns> = (0..3).map(wall).collect();
    sweeps.iter().enumerate().for_each(|(n, r)| give_with(&mut refinement, &big, r, n));
    let masks = vec![[0xffff, 0]; 167 * 167];
    let flows = vec![flow([10, 0]); 167 * 167];
    let perceived = Perceived {
        before: &masks,
        now: &masks,
        foreground: &[],
        marked: 0,
        rays: 0,
        state: &flows,
        proposal: &[] as &[Proposal],
    };
    let step = Step { side: 167, ..Step::default() };
    refinement.run(&Alone, &step, &perceived, |_| Some([10.0, 0.0]));
    let longest = refinement.things.found.iter().map(|f| f.extent).fold(0.0, f32::max);
    assert!(longest > EXTENT_MAX, "{longest}");
    let moves = |f: &Found| f.extent > EXTENT_MAX && f.moves;
    assert!(!refinement.things.found.iter().any(moves));
}

/// A long side slides along itself; only a few returns before it tell.
#[test]
fn what_moved_goes_on_by_less() {
    let side = |moved: f32| {
        let mut returns = Returns::flat();
        for k in 0..100 {
            let along = 12.0 + 0.4 * k as f32;
            returns.add([along, 30.3, GROUND + 1.5], 0);
            returns.add([along, 30.3, GROUND + 2.5], 0);
        }
        for k in 0..5 {
            for n in 0..2 {
                let (beside, height) = (29.4 - 0.35 * n as f32, GROUND + 1.2 + 0.4 * k as f32);
                returns.add([30.2 + moved, beside, height], 0);
            }
        }
        returns
    };
    let moving = |sweeps: &[Returns; 3], expected| {
        let mut refinement = Box::new(Refinement::new());
        sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
        run_expecting(&mut refinement, &[&sweeps[1], &sweeps[2]], &no_flow(), expected);
        motions(&refinement).iter().flatten().count()
    };
    let steady = [0.0, 1.2, 2.4].map(side);
    let still = [0.0; 3].map(side);
    assert_eq!(moving(&steady, None), 0);
    assert!(moving(&steady, Some([1.2, 0.0])) > 40);
    assert_eq!(moving(&still, Some([1.2, 0.0])), 0);
}

#[test]
fn odd_sweeps_yield_no_nonsense() {
    let mut random = Random(6);
    let mut column = Returns::flat();
    for _ in 0..50_000 {
        let [x, y] = [0; 2].map(|_| random.between(31.0, 32.0));
        column.add([x, y, GROUND + random.between(0.0, 14.0)], 0);
    }
    let mut nowhere = Returns::flat();
    for at in [[f32::NAN; 3], [f32::INFINITY; 3], [1e30, 5.0, 5.0], [5.0, 5.0, -1e30]] {
        nowhere.add(at, 0);
    }
    let mut tall = Returns::flat();
    for n in 0..2000 {
        tall.add([20.5, 20.5 + 0.002 * n as f32, GROUND + n as f32], 1);
    }
    let mut clusters = || {
        let mut returns = Returns::flat();
        for _ in 0..60 {
            let [x, y] = [0; 2].map(|_| random.between(0.0, SIDE as f32));
            for _ in 0..random.below(60) {
                let [x, y] = [x, y].map(|v| v + random.between(-1.0, 1.0));
                returns.add([x, y, GROUND + random.between(0.7, 6.0)], 0);
            }
        }
        returns
    };
    let [some, others] = [clusters(), clusters()];
    let odd = [
        some,
        others,
        Returns::default(),
        column,
        nowhere,
        tall,
        scattered(&mut random, 20_000, 16.0),
    ];
    let mut moving = 0;
    for first in &odd {
        for second in &odd {
            let flows: Vec<Flow> = (0..SIDE * SIDE)
                .map(|_| match random.below(3) {
                    0 => 0,
                    _ => flow([0; 2].map(|_| random.below(31) as i32 - 15)),
                })
                .collect();
            let found = found_in(&[second.clone(), first.clone(), second.clone()], &flows);
            check_sane(&found);
            moving += found.iter().flatten().count();
        }
    }
    assert!(moving > 0, "nothing was there to be wrong");
    // A sweep alone has no pair.
    assert!(
        found_in(&[odd[0].clone(), Returns::default()], &no_flow()).iter().all(Option::is_none)
    );
    let mut alone = Box::new(Refinement::new());
    give(&mut alone, &odd[0], 0);
    run(&mut alone, &[&odd[0], &odd[0]], &no_flow());
    assert!(motions(&alone).iter().all(Option::is_none));
}

#[test]
fn the_same_sweeps_yield_the_same_bits() {
    let mut random = Random(7);
    let mut sweep = |n: usize| {
        let car = Car { centre: [25.0 + 1.3 * n as f32, 30.0], yaw: 0.1 };
        let mut returns = scattered(&mut random, 3000, 8.0);
        car.add_to(&mut returns, &mut random);
        returns
    };
    let sweeps: Vec<Returns> = (0..4).map(&mut sweep).collect();
    let others: Vec<Returns> = (5..8).map(sweep).collect();
    let flows: Vec<Flow> = (0..SIDE * SIDE).map(|c| flow([(c % 3) as i32, 0])).collect();
    let wanted = found_in(&sweeps, &flows);
    assert!(wanted.iter().flatten().count() > 10);
    assert_eq!(found_in(&sweeps, &flows), wanted);
    // Whatever was before.
    let mut used = Box::new(Refinement::new());
    others.iter().enumerate().for_each(|(n, r)| give(&mut used, r, n));
    run(&mut used, &[&others[1], &others[2]], &flows);
    used.clear();
    sweeps.iter().enumerate().for_each(|(n, r)| give(&mut used, r, n));
    run(&mut used, &[&sweeps[2], &sweeps[3]], &flows);
    assert_eq!(motions(&used), wanted);
}

/// Columns that hold a thing.
fn things(cloud: &Cloud) -> BTreeSet<usize> {
    (0..SIDE * SIDE).filter(|c| cloud.levels(*c) != 0).collect()
}

#[test]
fn slopes_are_ground_and_boxes_on_them_are_not() {
    for slope in [0.0, 0.02, 0.04] {
        for direction in [[1.0, 0.0], [0.0, -1.0], [0.7, 0.7]] {
            let middle = SIDE as f32 / 2.0;
            let height = |x: f32, y: f32| {
                GROUND + slope * ((x - middle) * direction[0] + (y - middle) * direction[1])
            };
            let mut returns = Returns::ground(height);
            let empty = things(&returns.cloud());
            assert!(empty.is_empty(), "{slope} {direction:?}: {} columns", empty.len());
            let mut wanted = BTreeSet::new();
            for (i, j) in (30..34).flat_map(|i| (40..46).map(move |j| (i, j))) {
                let [x, y] = [i as f32 + 0.5, j as f32 + 0.5];
                returns.add([x, y, height(x, y) + 2.0], 0);
                wanted.insert(i * SIDE + j);
            }
            assert_eq!(things(&returns.cloud()), wanted, "{slope} {direction:?}");
        }
    }
}

#[test]
fn mirrored_returns_do_not_pull_the_ground_down() {
    let mut random = Random(8);
    let mut returns = Returns::flat();
    for _ in 0..500 {
        let [x, y] = [0; 2].map(|_| random.between(0.0, SIDE as f32));
        returns.add([x, y, GROUND - random.between(6.0, 20.0)], 0);
    }
    assert_eq!(things(&returns.cloud()), BTreeSet::new());
    // What lies on it is apart from things, and what hangs high above; what stands on it is not.
    let heights = [0.1, 1.0, 13.5, 14.5];
    heights.iter().for_each(|h| returns.add([30.5, 30.5, GROUND + h], 0));
    let last = returns.points.len() - heights.len();
    let (_, apart) = returns.fill(&mut Box::new(Cloud::new()));
    assert_eq!(apart[last..], [true, false, false, true]);
}
