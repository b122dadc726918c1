use super::evaluate::{OURS, Outcome, evaluate, histories, methods};
use super::kept;
use super::object::{centroid, moment_at};
use super::simulated::{Drives, Sets, Wanted, simulate};
use super::tables;
use crate::labels::Kind;
use crate::scratch::Scratch;
use glam::DVec3;
use raywake_sim::SensorRig;
use std::fs;
use std::sync::OnceLock;

fn wanted() -> Wanted {
    let moving = [Kind::Car, Kind::Truck, Kind::Cyclist, Kind::Pedestrian];
    Wanted { parked: 5, moving: moving.map(|kind| (kind, 1)).into() }
}

fn drives(seed: u64) -> Drives {
    Drives { seed, rig: SensorRig::hdl32x4() }
}

/// Sets from one drive; casting them takes seconds.
fn small() -> &'static Sets {
    static SETS: OnceLock<Sets> = OnceLock::new();
    SETS.get_or_init(|| simulate(&drives(1), &wanted()))
}

#[test]
fn sets_are_as_requested_and_reproducible() {
    let sets = small();
    assert_eq!((sets.stationary.len(), sets.moving.len()), (5, 4));
    let mut kinds: Vec<Kind> = sets.moving.iter().map(|o| o.kind).collect();
    kinds.sort();
    assert_eq!(kinds, [Kind::Car, Kind::Truck, Kind::Cyclist, Kind::Pedestrian]);
    for object in sets.stationary.iter().chain(&sets.moving) {
        assert!(object.span_s() > 3.8 && object.span_s() < 6.6, "{}", object.name);
        assert!(object.returns.is_sorted_by(|a, b| a.time_s <= b.time_s));
        assert_eq!(object.batches.iter().map(|b| b.len()).sum::<usize>(), object.returns.len());
        // Its returns lie on it throughout.
        let half = 0.5 * DVec3::from_array(object.size) + 0.35;
        for (time_s, at) in object.batches().map(centroid) {
            let off = moment_at(&object.truth, time_s).project(at);
            assert!(off.abs().cmple(half).all(), "{}: {off} at {time_s} s", object.name);
        }
    }
    let scratch = Scratch::new();
    // Simulated anew, then read.
    for _ in 0..2 {
        assert!(kept::sets(scratch.path(), &drives(1), &wanted()).unwrap() == *sets);
    }
    let file = scratch.path().join("objects-1.bin");
    let whole = fs::read(&file).unwrap();
    assert!(kept::read(&whole, kept::key(&drives(1), &wanted())).is_some());
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    for bad in [&damaged[..], &whole[..whole.len() / 2], &[]] {
        assert!(kept::read(bad, kept::key(&drives(1), &wanted())).is_none());
    }
    assert!(kept::read(&whole, kept::key(&drives(2), &wanted())).is_none(), "other drives");
    let full = Drives { rig: SensorRig::hdl32x4_full(), ..drives(1) };
    assert!(kept::read(&whole, kept::key(&full, &wanted())).is_none(), "another rig");
}

/// Errors by kind of the baseline and of ours: m, m/s, rad, rad/s, nats above the truth.
const PINNED: &str = "\
Car: 0.476 1.105 0.193 0.074 0.386 | 0.028 0.082 0.002 0.002 -0.015
Car: 0.958 0.915 0.406 0.085 0.490 | 0.059 0.074 0.002 0.002 -0.022
Car: 1.203 0.921 0.400 0.101 0.491 | 0.046 0.040 0.003 0.002 -0.016
Car: 1.255 0.874 0.634 0.223 0.648 | 0.077 0.068 0.001 0.001 -0.021
Car: 1.337 0.908 0.447 0.165 0.475 | 0.011 0.024 0.001 0.001 -0.003
Car: 0.011 0.044 0.002 0.002 0.013 | 0.008 0.022 0.000 0.000 -0.006
Truck: 0.041 0.040 0.004 0.004 -0.040 | 0.050 0.065 0.000 0.000 -0.129
Cyclist: 0.082 0.170 0.007 0.005 0.007 | 0.014 0.035 0.001 0.002 -0.029
Pedestrian: 0.258 0.182 0.071 0.035 -0.077 | 0.041 0.046 0.016 0.016 -0.149
";

#[test]
fn pinned_errors() {
    let objects = [small().stationary.clone(), small().moving.clone()].concat();
    let outcomes = evaluate(&objects, &histories(&objects), 2);
    let row = |o: &Outcome| {
        let of = |n: usize| {
            let (score, r) = (&o.scores[n], o.scores[n].errors.rmse());
            let numbers = [r.position, r.velocity, r.heading, r.turn_rate];
            let numbers = numbers.into_iter().chain([score.entropy - o.entropy]);
            numbers.map(|v| format!("{v:.3}")).collect::<Vec<_>>().join(" ")
        };
        format!("{:?}: {} | {}\n", o.kind, of(0), of(OURS))
    };
    let found: String = outcomes.iter().map(row).collect();
    assert_eq!(found, PINNED, "\n{found}");
}

#[test]
fn tables_have_a_row_for_every_tracker() {
    let objects = &small().stationary[..2];
    let outcomes = evaluate(objects, &histories(objects), 1);
    let set =
        tables::Set { id: "stationary".into(), name: "simulated, stationary".into(), outcomes };
    let text = tables::errors(&set).text();
    for (name, _) in methods() {
        assert!(text.contains(name), "{text}");
    }
    assert!(text.contains("0.388") && text.contains("2 objects"), "{text}");
    // Against itself the baseline is never better, and closes nothing.
    assert_eq!((set.better(0, |r| r.position), set.gap_closed(0)), (0.0, 0.0));
    assert!(set.better(OURS, |r| r.position) > 0.5 && set.gap_closed(OURS) > 0.3);
    let entropies = tables::entropies(&[set]).text();
    assert!(entropies.contains("1.920") && entropies.contains("42"), "{entropies}");
}
