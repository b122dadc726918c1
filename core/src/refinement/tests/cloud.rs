//! Clouds, their ground and segments against naive oracles.

use super::super::segments::{Segments, agree};
use super::*;
use crate::params::CLOUD_MAX;
use std::collections::{BTreeMap, BTreeSet};

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
            // Where the first within this distance is near enough, none, some and all are.
            let enough = [0.0, 0.3, 2.0][n / 6 % 3];
            match cloud.nearest(at, sensor, [1.0, enough]) {
                Some((d2, p)) => {
                    let is_enough = d2 == least || d2 < enough * enough;
                    assert!(is_enough && distance(p.at) == d2, "{at:?}: {d2}, not {least}");
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
fn the_first_return_of_each_subvoxel_is_kept() {
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
        if (0.6..14.0).contains(&height) {
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
    // The middle of every part of a voxel, in random order.
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
    let mut cloud = Kept::new();
    let (dropped, _) = returns.fill(&mut cloud);
    assert_eq!(dropped, parts.len() - CLOUD_MAX);
    assert!(dropped > 20_000);
    let all = all_kept(&cloud);
    assert_eq!(all.len(), CLOUD_MAX);
    // Those of the last columns are dropped.
    let in_column = |p: &[f32; 3], c: u32| column_of(*p) < c;
    let last = column_of(all[CLOUD_MAX - 1].0);
    let before = parts.iter().filter(|p| in_column(p, last)).count();
    assert!(
        before <= CLOUD_MAX && parts.iter().filter(|p| in_column(p, last + 1)).count() >= CLOUD_MAX
    );
    // The result is the same whatever the cloud held before.
    assert_eq!(returns.fill(&mut cloud).0, dropped);
    assert!(all == all_kept(&cloud));
    // And it can be used.
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    for n in 0..3 {
        give(&mut refinement, &returns, n);
    }
    run(&mut refinement, &no_flow());
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
        let kept = returns.cloud();
        let cloud = kept.all();
        let flows: Vec<Flow> = (0..SIDE * SIDE)
            .map(|_| if random.below(2) == 0 { 0 } else { pack_flow([random.below(5) as i32, 0]) })
            .collect();
        let excluded = random.below(SIDE * SIDE);
        let part = |c: usize| c != excluded && cloud.levels(c) != 0;
        let mut segments = raywake_alloc_guard::boxed!(Segments, Segments::new());
        let (scaled, detail) = (&scaled(), cloud.detail);
        let scans = Scans {
            scaled,
            first: cloud,
            targets: &[],
            detail,
            scores: &[],
            traffic: &[],
            span_s: 0.1,
            history: &NO_HISTORY,
        };
        segments.find(&scans, part, |a, b| agree(&scans, flows[a], flows[b]));
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

/// Columns that hold part of a cluster.
fn occupied(kept: &Kept) -> BTreeSet<usize> {
    (0..SIDE * SIDE).filter(|c| kept.all().levels(*c) != 0).collect()
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
            let empty = occupied(&returns.cloud());
            assert!(empty.is_empty(), "{slope} {direction:?}: {} columns", empty.len());
            let mut wanted = BTreeSet::new();
            for (i, j) in (30..34).flat_map(|i| (40..46).map(move |j| (i, j))) {
                let [x, y] = [i as f32 + 0.5, j as f32 + 0.5];
                returns.add([x, y, height(x, y) + 2.0], 0);
                wanted.insert(i * SIDE + j);
            }
            assert_eq!(occupied(&returns.cloud()), wanted, "{slope} {direction:?}");
        }
    }
}

#[test]
fn a_bank_is_ground_but_a_car_in_front_of_it_is_not() {
    let bank = |x: f32| GROUND + 0.4 * (x - 40.0).clamp(0.0, 12.0);
    let mut returns = Returns::ground(|x, _| bank(x));
    assert_eq!(occupied(&returns.cloud()), BTreeSet::new());
    let mut random = Random(7);
    Car { centre: [32.0, 31.0], yaw: 0.5 }.add_to(&mut returns, &mut random);
    let mut flat = Returns::flat();
    Car { centre: [32.0, 31.0], yaw: 0.5 }.add_to(&mut flat, &mut Random(7));
    assert_eq!(occupied(&returns.cloud()), occupied(&flat.cloud()));
    // A wall is steeper.
    let mut returns = Returns::ground(|x, _| bank(x));
    (0..40).for_each(|n| returns.add([45.5, 30.5, bank(45.5) + 0.1 * n as f32], 0));
    assert_eq!(occupied(&returns.cloud()).into_iter().collect::<Vec<_>>(), [45 * SIDE + 30]);
}

#[test]
fn mirrored_returns_do_not_pull_the_ground_down() {
    let mut random = Random(8);
    let mut returns = Returns::flat();
    for _ in 0..500 {
        let [x, y] = [0; 2].map(|_| random.between(0.0, SIDE as f32));
        returns.add([x, y, GROUND - random.between(6.0, 20.0)], 0);
    }
    assert_eq!(occupied(&returns.cloud()), BTreeSet::new());
    // Returns on it, and high above it, are apart from clusters; those in between are not.
    let heights = [0.1, 1.0, 13.5, 14.5];
    heights.iter().for_each(|h| returns.add([30.5, 30.5, GROUND + h], 0));
    let last = returns.points.len() - heights.len();
    let mut cloud = Kept::new();
    let (_, apart) = returns.fill(&mut cloud);
    assert_eq!(apart[last..], [true, false, false, true]);
}
