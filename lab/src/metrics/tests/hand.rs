//! Cases small enough to work out by hand.

use super::*;
use crate::labels::Kind;
use grades::Grades;
use std::f64::consts::FRAC_PI_4;

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-6, "{a} is not {b}");
}

/// Two cars in the bucket of 0.08 to 0.12 m, one beyond 2 m, one at rest, a pedestrian at rest.
fn street() -> (Pair, Vec<[f32; 3]>) {
    let pair = still(vec![
        point("REGULAR_VEHICLE", [0.10, 0.0, 0.0]),
        point("REGULAR_VEHICLE", [0.0, 0.11, 0.0]),
        point("REGULAR_VEHICLE", [3.0, 0.0, 0.0]),
        point("REGULAR_VEHICLE", [0.0, 0.0, 0.01]),
        point("PEDESTRIAN", [0.0; 3]),
        point("STOP_SIGN", [0.0; 3]),
    ]);
    let estimates = vec![
        [0.10, 0.05, 0.0],
        [0.0, 0.12, 0.0],
        [1.5, 0.0, 0.0],
        [0.0, 0.0, 0.03],
        [0.0, 0.04, 0.0],
        [9.0, 9.0, 9.0],
    ];
    (pair, estimates)
}

#[test]
fn bucket_normalised() {
    let (pair, estimates) = street();
    let mut metric = BucketedEpe::default();
    metric.add(&score(&pair, &estimates));
    let errors = metric.errors(Range::Near);
    let car = &errors.classes[1];
    assert_eq!((car.class, car.buckets.len()), (Class::Car, 51));
    let slow = car.buckets[2];
    assert_eq!((slow.from_m, slow.to_m, slow.count), (0.08, 0.12, 2));
    near(slow.epe_m, 0.03);
    near(slow.mean_speed_m, 0.105);
    near(slow.normalised(), 0.03 / 0.105);
    let fast = car.buckets[50];
    assert_eq!((fast.from_m, fast.to_m, fast.count), (2.0, f64::INFINITY, 1));
    near(fast.normalised(), 0.5);
    near(car.static_epe_m, 0.02);
    near(car.dynamic, (0.03 / 0.105 + 0.5) / 2.0);
    let pedestrian = &errors.classes[3];
    near(pedestrian.static_epe_m, 0.04);
    assert!(pedestrian.dynamic.is_nan() && pedestrian.buckets[1].epe_m.is_nan());
    // Empty classes are left out, and the sign, though wrong, belongs to no class.
    near(errors.mean_static_epe_m, 0.03);
    near(errors.mean_dynamic, car.dynamic);
    assert!(errors.classes[2].static_epe_m.is_nan());
    let sign = metric.category(Category::from_name("STOP_SIGN").unwrap(), Range::Near);
    assert_eq!(sign[0].count, 1);
}

#[test]
fn three_way() {
    let (mut pair, mut estimates) = street();
    pair.points.push(point("BACKGROUND", [0.0; 3]));
    estimates.push([0.0, 0.0, 0.06]);
    let mut metric = ThreeWayEpe::default();
    metric.add(&score(&pair, &estimates));
    let errors = metric.errors(Range::All);
    near(errors.foreground_dynamic.epe_m, (0.05 + 0.01 + 1.5) / 3.0);
    near(errors.foreground_static.epe_m, 0.03);
    near(errors.background_static.epe_m, 0.06);
    assert_eq!((errors.foreground_dynamic.count, errors.background_dynamic.count), (3, 0));
    near(errors.mean_epe_m(), (0.52 + 0.03 + 0.06) / 3.0);
    let car = metric.category(Category::from_name("REGULAR_VEHICLE").unwrap(), Range::All);
    assert_eq!(car.map(|b| b.count), [1, 3]);
}

#[test]
fn nothing_at_all_and_nothing_moving() {
    let empty = BucketedEpe::default().errors(Range::Near);
    assert!(empty.mean_static_epe_m.is_nan() && empty.mean_dynamic.is_nan());
    assert!(ThreeWayEpe::default().errors(Range::Near).mean_epe_m().is_nan());
    let nothing = AccuracyTable::default().accuracy(|_| true, PointMotion::Any);
    assert!(nothing.count == 0 && nothing.epe_m.is_nan() && nothing.strict.is_nan());
    let pair = still(vec![point("BUS", [0.0; 3]), point("BACKGROUND", [0.0; 3])]);
    let mut grades = Grades::default();
    grades.add(&pair, &reference::zero_motion(&pair), &Rules::OFFICIAL).unwrap();
    let errors = grades.bucketed.errors(Range::Near);
    assert_eq!(errors.mean_static_epe_m, 0.0);
    assert!(errors.mean_dynamic.is_nan());
    assert!(grades.three_way.errors(Range::Near).mean_epe_m().is_nan());
}

/// Buckets of speeds on or next to an edge. As in the grader: rounded to f32, compared in f64.
#[test]
fn edges_of_speed() {
    let bucket = |speed: f32| {
        let pair = still(vec![point("BUS", [speed, 0.0, 0.0])]);
        let mut metric = BucketedEpe::default();
        metric.add(&score(&pair, &[[0.0; 3]]));
        let buckets = metric.category(Category::from_name("BUS").unwrap(), Range::All);
        buckets.iter().position(|b| b.count > 0).unwrap()
    };
    assert_eq!([bucket(0.0), bucket(1.0), bucket(2.0), bucket(1e6)], [0, 25, 50, 50]);
    // The nearest f32 lies below 0.04, below 0.08, above 0.2.
    assert_eq!([bucket(0.04), bucket(0.08), bucket(0.2)], [0, 1, 5]);
    assert_eq!(bucket(2.0f32.next_down()), 49);
    let moving =
        |speed: f32| score(&still(vec![point("BUS", [0.0, speed, 0.0])]), &[[0.0; 3]])[0].moving();
    assert!(moving(0.05) && !moving(0.05f32.next_down()));
}

/// Bounds are excluded, and are in the vehicle's frame at the second sweep.
#[test]
fn edges_of_range() {
    let mut pair = still(vec![point("BUS", [0.0; 3])]);
    let mut near = |position_m: [f32; 3], forward_m: f64| {
        pair.points[0].position_m = position_m;
        pair.second_from_first = Pose::planar(-forward_m, 0.0, 0.0, 0.0);
        pair.counts(&pair.points[0], &Rules::OFFICIAL)
    };
    assert_eq!(near([34.9, -34.9, 0.0], 0.0), Some(true));
    assert_eq!(near([35.0, 0.0, 0.0], 0.0), Some(false));
    assert_eq!(near([0.0, -35.0, 0.0], 0.0), Some(false));
    assert_eq!(near([35.5, 0.0, 0.0], 1.0), Some(true));
    assert_eq!(near([48.0, 0.0, 0.0], 0.0), None);
    assert_eq!(near([48.5, 0.0, 0.0], 1.0), Some(false));
    assert_eq!(near([-47.5, 0.0, 0.0], 1.0), None);
    assert_eq!(near([0.0, 0.0, 2.5], 0.0), None);
    assert_eq!(near([0.0, 0.0, -2.5], 0.0), None);
    assert_eq!(near([f32::NAN, 0.0, 0.0], 0.0), None);
}

#[test]
fn what_counts() {
    let mut pair = still(vec![point("BUS", [0.0; 3]); 3]);
    pair.points[1].valid = false;
    pair.points[2].ground = true;
    let flows = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    let errors = |rules: &Rules| -> Vec<f32> {
        pair.score(&flows, rules).unwrap().iter().map(|s| s.error_m).collect()
    };
    assert_eq!(errors(&Rules::OFFICIAL), [1.0]);
    assert_eq!(errors(&Rules { ground: true, ..Rules::OFFICIAL }), [1.0, 3.0]);
}

#[test]
fn what_cannot_be_scored() {
    let mut pair = still(vec![point("BUS", [0.0; 3]); 2]);
    let refused = |pair: &Pair, flows: &[[f32; 3]]| {
        pair.score(flows, &Rules::OFFICIAL).unwrap_err().to_string()
    };
    assert_eq!(refused(&pair, &[[0.0; 3]]), "1 rows, but the sweep has 2 returns");
    for bad in [f32::NAN, f32::INFINITY, f32::MAX] {
        let flows = [[0.0; 3], [0.0, bad, 0.0]];
        assert_eq!(refused(&pair, &flows), "row 1: the estimated flow is not finite");
    }
    pair.points[0].flow_m[2] = f32::NAN;
    assert_eq!(refused(&pair, &[[0.0; 3]; 2]), "row 0: the true flow is not finite");
    // Errors that do not count do not matter.
    pair.points[0].valid = false;
    assert_eq!(score(&pair, &[[f32::NAN; 3], [0.0; 3]]).len(), 1);
    // And nothing of a refused pair is counted.
    let mut grades = Grades::default();
    assert!(grades.add(&pair, &[[0.0; 3], [f32::NAN; 3]], &Rules::OFFICIAL).is_err());
    assert_eq!(grades, Grades::default());
}

#[test]
fn merging_equals_adding() {
    let (pair, estimates) = street();
    let zero = reference::zero_motion(&pair);
    let (mut both, mut first, mut second) =
        (Grades::default(), Grades::default(), Grades::default());
    both.add(&pair, &estimates, &Rules::OFFICIAL).unwrap();
    both.add(&pair, &zero, &Rules::OFFICIAL).unwrap();
    first.add(&pair, &estimates, &Rules::OFFICIAL).unwrap();
    second.add(&pair, &zero, &Rules::OFFICIAL).unwrap();
    assert_ne!(first, both);
    first.bucketed.merge(&second.bucketed);
    first.three_way.merge(&second.three_way);
    first.over_ground.merge(&second.over_ground);
    first.with_ego_motion.merge(&second.with_ego_motion);
    let figures = |g: &Grades| g.bucketed.errors(Range::Near).mean_dynamic;
    near(figures(&first), figures(&both));
    let epe = |g: &Grades| g.three_way.errors(Range::Near).foreground_dynamic;
    near(epe(&first).epe_m, epe(&both).epe_m);
    assert_eq!(epe(&first).count, 6);
    let all = |t: &AccuracyTable| t.accuracy(|_| true, PointMotion::Any);
    assert_eq!(all(&first.over_ground).count, 12);
    near(all(&first.over_ground).angle_rad, all(&both.over_ground).angle_rad);
    near(all(&first.with_ego_motion).strict, all(&both.with_ego_motion).strict);
}

#[test]
fn accuracies() {
    let accuracy = |truth: f32, estimate: f32| {
        let pair = still(vec![point("BUS", [truth, 0.0, 0.0])]);
        let mut table = AccuracyTable::default();
        table.add(&score(&pair, &[[estimate, 0.0, 0.0]]));
        let a = table.accuracy(|_| true, PointMotion::Any);
        [a.strict, a.relaxed, a.outliers]
    };
    // By length, by share, by neither.
    assert_eq!(accuracy(0.5, 0.54), [1.0, 1.0, 0.0]);
    assert_eq!(accuracy(2.0, 2.09), [1.0, 1.0, 0.0]);
    assert_eq!(accuracy(1.0, 1.09), [0.0, 1.0, 0.0]);
    assert_eq!(accuracy(3.0, 3.25), [0.0, 1.0, 0.0]);
    assert_eq!(accuracy(1.0, 1.2), [0.0, 0.0, 1.0]);
    // An outlier by length alone; static returns are outliers by share, however small the error.
    assert_eq!(accuracy(10.0, 10.4), [1.0, 1.0, 1.0]);
    assert_eq!(accuracy(0.0, 0.01), [1.0, 1.0, 1.0]);
    assert_eq!(accuracy(0.0, 0.0), [1.0, 1.0, 0.0]);
}

#[test]
fn accuracies_by_class_and_motion() {
    let pair = still(vec![
        point("BUS", [0.0; 3]),
        point("BUS", [1.0, 0.0, 0.0]),
        point("PEDESTRIAN", [0.1, 0.0, 0.0]),
    ]);
    let mut table = AccuracyTable::default();
    table.add(&score(&pair, &[[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]]));
    let bus = |c: Category| c.name() == "BUS";
    let parked = table.accuracy(bus, PointMotion::Standing);
    assert_eq!(parked.count, 1);
    near(parked.epe_m, 0.1);
    // (0, 0, 0, 0.1 s) against (0.1 m, 0, 0, 0.1 s).
    near(parked.angle_rad, FRAC_PI_4);
    assert_eq!(table.accuracy(bus, PointMotion::Any).count, 2);
    let moving = table.accuracy(|_| true, PointMotion::Moving);
    assert_eq!((moving.count, moving.strict), (2, 0.5));
    near(moving.angle_rad, FRAC_PI_4 / 2.0);
}

#[test]
fn the_vehicles_motion() {
    // The vehicle drives one metre ahead: static structure comes one metre closer.
    let mut pair = still(vec![point("BUS", [0.0; 3]), point("BUS", [1.0, 0.0, 0.0])]);
    pair.second_from_first = Pose::planar(-1.0, 0.0, 0.0, 0.0);
    let estimates = reference::carried(&pair);
    assert_eq!(estimates, [[1.0, 0.0, 0.0]; 2]);
    let scored = score(&pair, &estimates);
    assert_eq!([scored[0].error_m, scored[1].error_m], [1.0, 0.0]);
    let seen = scored[0].with_ego_motion(&pair.second_from_first);
    assert_eq!((seen.truth_m, seen.estimate_m), ([-1.0, 0.0, 0.0], [0.0; 3]));
    assert!(!seen.moving());
    // Rotation, too, carries along.
    pair.second_from_first = Pose::planar(0.0, 0.0, 0.0, -0.1);
    let scored = score(&pair, &reference::carried(&pair));
    let seen = scored[0].with_ego_motion(&pair.second_from_first);
    assert!(seen.estimate_m.iter().all(|v| v.abs() < 1e-6), "{seen:?}");
    assert!((seen.truth_m[1] + 0.998_334).abs() < 1e-4, "{seen:?}");
}

#[test]
fn truth_on_a_lattice() {
    let pair = still(vec![point("BUS", [0.44, -0.46, 0.0])]);
    let rounded = reference::rounded(&pair, 0.3)[0];
    assert_eq!(rounded, [0.3, -0.6, 0.0]);
}

#[test]
fn categories_and_classes() {
    assert_eq!(Category::from_number(-1), Some(Category::BACKGROUND));
    assert_eq!(Category::from_number(0).unwrap().name(), "ANIMAL");
    assert_eq!(Category::from_number(18).unwrap().name(), "REGULAR_VEHICLE");
    assert_eq!(Category::from_number(29).unwrap().name(), "WHEELED_RIDER");
    assert_eq!((Category::from_number(30), Category::from_number(-2)), (None, None));
    assert_eq!(Category::all().count(), 31);
    let members = |class| Category::all().filter(|c| c.class() == class).count();
    assert_eq!(Class::ALL.map(|c| members(Some(c))), [1, 1, 9, 4, 6]);
    assert_eq!(members(None), 10);
    let class = |kind| Category::of_kind(kind).and_then(Category::class);
    assert_eq!(class(Kind::Van), Some(Class::Car));
    assert_eq!(class(Kind::Tram), Some(Class::OtherVehicles));
    assert_eq!(class(Kind::Cyclist), Some(Class::WheeledVru));
    assert_eq!(class(Kind::Other), None);
}
