//! An estimator alone, with threads, and with invalid input.
#![cfg(feature = "std")]

use std::mem::MaybeUninit;
use std::sync::OnceLock;

use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Timing};
use raywake_core::team::SingleThread;
use raywake_embed::{
    CreateError, EstimatorOptions, FlowEstimator, Memory, ObjectRecord, ReturnsBy, StepError,
    SweepError, SweepPlace, TeamEstimator,
};
use raywake_sim::{Drive, Ego, Options, SimSweep};

fn drive() -> Drive {
    let ego = Ego::Turn { left: true, speed: 6.0 };
    Drive::new(3, Options { sweeps: 4, ego, ..Options::default() })
}

fn sweeps() -> &'static [SimSweep] {
    static SWEEPS: OnceLock<Vec<SimSweep>> = OnceLock::new();
    SWEEPS.get_or_init(|| drive().collect())
}

fn options() -> EstimatorOptions {
    EstimatorOptions {
        profile: Profile::hdl64(),
        rig: drive().rig(),
        points_max: 150_000,
        registers: false,
        objects: false,
    }
}

fn memory(bytes: usize) -> Memory {
    vec![MaybeUninit::uninit(); bytes].leak()
}

fn estimator(options: &EstimatorOptions) -> FlowEstimator {
    FlowEstimator::new(options, memory(options.bytes().unwrap())).unwrap()
}

fn place(sweep: &SimSweep) -> SweepPlace {
    let (pose, twist) = (Some(sweep.world_from_vehicle), Some(sweep.twist));
    SweepPlace { stamp_s: sweep.stamp_s, pose, twist }
}

#[test]
fn threads_change_nothing() {
    let mut alone = estimator(&options());
    let mut expected = Digest::default();
    for sweep in sweeps() {
        alone.step(&SingleThread, &place(sweep), &sweep.points[..]).unwrap();
        alone.add_to(&mut expected);
    }
    assert!(alone.columns().iter().any(|c| c.velocity_world_mps != [0.0; 2]));
    for threads in [1, 3] {
        let mut team = TeamEstimator::new(estimator(&options()), threads).unwrap();
        assert_eq!(team.threads(), threads);
        let mut digest = Digest::default();
        for sweep in sweeps() {
            let found = team.step(&place(sweep), &sweep.points[..]).unwrap();
            team.read(|estimator| {
                estimator.add_to(&mut digest);
                let pair = found.pair.map(|pair| (pair.columns, pair.points));
                let points = estimator.points().map(|points| (points.count(), points.iter().len()));
                assert_eq!(
                    pair.map(|(columns, _)| columns),
                    points.map(|_| estimator.columns().len())
                );
                assert_eq!(pair.map(|(_, points)| (points, points)), points);
            })
            .unwrap();
        }
        assert_eq!(digest, expected, "{threads} threads");
    }
}

/// A step is completed even if nobody asks for its result.
#[test]
fn received_is_done() {
    for threads in [1, 2] {
        let teams = [false, true].map(|dropped| {
            let mut team = TeamEstimator::new(estimator(&options()), threads).unwrap();
            let mut digest = Digest::default();
            for sweep in sweeps() {
                let received = team.receive(&place(sweep), &sweep.points[..]).unwrap();
                if dropped {
                    drop(received);
                } else {
                    received.complete().unwrap();
                }
                team.read(|estimator| estimator.add_to(&mut digest)).unwrap();
            }
            digest
        });
        assert_eq!(teams[0], teams[1]);
    }
}

/// Tracking objects changes nothing else, and threads change nothing about the objects.
#[test]
fn objects_are_followed() {
    let following = EstimatorOptions { objects: true, ..options() };
    let (mut plain, mut alone) = (estimator(&options()), estimator(&following));
    let mut team = TeamEstimator::new(estimator(&following), 2).unwrap();
    let mut digests = [Digest::default(); 2];
    for sweep in sweeps() {
        let points = &sweep.points[..];
        let found = plain.step(&SingleThread, &place(sweep), points).unwrap();
        assert_eq!((found.objects, plain.objects()), (0, &[][..]));
        let found = alone.step(&SingleThread, &place(sweep), points).unwrap();
        assert_eq!(found.objects, alone.objects().len());
        plain.add_to(&mut digests[0]);
        alone.add_to(&mut digests[1]);
        assert_eq!(team.step(&place(sweep), points), Ok(found));
        team.read(|team| assert_eq!(team.objects(), alone.objects())).unwrap();
    }
    assert_eq!(digests[0], digests[1]);
    let before = sweeps()[sweeps().len() - 2].stamp_s;
    let seen = alone.objects();
    assert!(seen.iter().any(|o| o.velocity.is_some() && o.time_s >= before), "{seen:?}");
    let records: Vec<ObjectRecord> = seen.iter().map(ObjectRecord::from).collect();
    assert!(records.iter().all(|o| o.observations >= 3 && o.size_m.iter().all(|m| *m < 30.0)));
}

/// Whatever panics during a call ends as an error, and so does every later call.
#[test]
fn panics_are_contained() {
    let sweep = &sweeps()[0];
    let points = &sweep.points[..];
    for threads in [1, 2] {
        let team = || TeamEstimator::new(estimator(&options()), threads).unwrap();
        let mut receiving = team();
        let at = |n| if n == points.len() / 2 { panic!("a defect") } else { points[n] };
        let broken = ReturnsBy { count: points.len(), at };
        assert_eq!(receiving.step(&place(sweep), broken), Err(StepError::Failed));
        let mut reading = team();
        assert!(reading.step(&place(sweep), points).is_ok());
        assert_eq!(reading.read(|_| panic!("a defect")), Err::<(), _>(StepError::Failed));
        for mut failed in [receiving, reading] {
            assert_eq!(failed.step(&place(sweep), points), Err(StepError::Failed));
            assert_eq!(failed.read(FlowEstimator::tracklet_count), Err(StepError::Failed));
        }
    }
}

#[test]
fn poses_are_found_and_twists_follow_from_poses() {
    let mut finding = estimator(&EstimatorOptions { registers: true, ..options() });
    let mut given = estimator(&options());
    for sweep in sweeps() {
        let points = &sweep.points[..];
        let here = SweepPlace { stamp_s: sweep.stamp_s, ..SweepPlace::default() };
        let found = finding.step(&SingleThread, &here, points).unwrap();
        assert!(found.pose_status.is_some());
        let first = sweeps()[0].world_from_vehicle;
        let off = (first.inverse() * sweep.world_from_vehicle).inverse() * found.pose;
        assert!(off.translation.length() < 0.1, "{off:?}");
        let with_pose = SweepPlace { pose: Some(sweep.world_from_vehicle), ..here };
        let made = given.step(&SingleThread, &with_pose, points).unwrap();
        assert_eq!((made.pose, made.pose_status), (sweep.world_from_vehicle, None));
        assert_eq!(made.pair.is_some(), made.reset.is_none());
    }
}

#[test]
fn memory_is_as_large_as_stated() {
    let all = EstimatorOptions { registers: true, objects: true, points_max: 1, ..options() };
    for options in [options(), all] {
        let bytes = options.bytes().unwrap();
        let too_small = FlowEstimator::new(&options, memory(bytes - 1)).err();
        assert_eq!(too_small, Some(CreateError::Memory(bytes)));
        for skip in [0, 1, 7] {
            let memory = &mut memory(bytes + skip)[skip..];
            assert!(FlowEstimator::new(&options, memory).is_ok(), "{skip}");
        }
    }
}

#[test]
fn invalid_sets_of_options() {
    let refused = |change: &dyn Fn(&mut EstimatorOptions)| {
        let mut options = options();
        change(&mut options);
        let memory = memory(options.bytes().unwrap_or(1 << 20));
        FlowEstimator::new(&options, memory).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let nan = f64::NAN;
    assert!(refused(&|o| o.profile.side = 100).contains("`side` must be odd"));
    assert!(refused(&|o| o.profile.levels = 12).contains("weights do not fit"));
    for rig in [
        refused(&|o| o.rig.sensors.clear()),
        refused(&|o| o.rig.ground_m = nan),
        refused(&|o| o.rig.sensors[0].translation.x = nan),
        refused(&|o| o.rig.sensors[0].rotation.w = 3.0),
        refused(&|o| o.rig.own_vehicle = Some([[0.0, f32::INFINITY], [1.0, 1.0]])),
        refused(&|o| o.rig.timing = Timing::Azimuth { span_s: 0.0 }),
        refused(&|o| o.rig.timing = Timing::Offset { from_s: nan, span_s: 0.1 }),
    ] {
        assert!(rig.contains("the rig needs"), "{rig}");
    }
    assert!(refused(&|o| o.points_max = usize::MAX / 8).contains("bytes of memory"));
}

/// Gives an estimator one invalid sweep after another.
fn give_invalid_sweeps(estimator: &mut FlowEstimator, here: SweepPlace, points: &[Point]) {
    let far = Some(Pose { translation: glam::DVec3::NAN, ..Pose::IDENTITY });
    let away = glam::DVec3::Y * 1e9;
    let away = Some(Pose { translation: away, ..Pose::IDENTITY });
    let odd = Some(Pose { rotation: glam::DQuat::IDENTITY * 2.0, ..Pose::IDENTITY });
    let fast = Some(Twist { linear: glam::DVec3::INFINITY, ..Twist::ZERO });
    for (place, why) in [
        (SweepPlace { stamp_s: f64::NAN, ..here }, SweepError::Implausible),
        (SweepPlace { stamp_s: 1e11, ..here }, SweepError::Implausible),
        (SweepPlace { pose: far, ..here }, SweepError::Implausible),
        (SweepPlace { pose: away, ..here }, SweepError::Implausible),
        (SweepPlace { pose: odd, ..here }, SweepError::Implausible),
        (SweepPlace { twist: fast, ..here }, SweepError::Implausible),
        (SweepPlace { pose: None, ..here }, SweepError::Pose),
    ] {
        assert_eq!(estimator.step(&SingleThread, &place, points), Err(why));
    }
    let many = ReturnsBy { count: 150_001, at: |_| Point::default() };
    assert_eq!(estimator.step(&SingleThread, &here, many), Err(SweepError::Points(150_000)));
}

#[test]
fn an_invalid_sweep_changes_nothing() {
    let digests = [false, true].map(|pestered| {
        let mut estimator = estimator(&options());
        let mut digest = Digest::default();
        for sweep in sweeps() {
            if pestered {
                give_invalid_sweeps(&mut estimator, place(sweep), &sweep.points);
            }
            estimator.step(&SingleThread, &place(sweep), &sweep.points[..]).unwrap();
            estimator.add_to(&mut digest);
        }
        digest
    });
    assert_eq!(digests[0], digests[1]);
}

#[test]
fn no_points_and_many_bad_ones() {
    let mut team = TeamEstimator::new(estimator(&options()), 2).unwrap();
    for n in 0..3 {
        let here =
            SweepPlace { stamp_s: 0.1 * f64::from(n), pose: Some(Pose::IDENTITY), twist: None };
        let bad = Point { position: [f32::NAN; 3], ..Point::default() };
        let count = if n == 1 { 0 } else { 1000 };
        let found = team.step(&here, ReturnsBy { count, at: |_| bad }).unwrap();
        assert_eq!(found.dropped.not_finite, count as u64);
    }
    assert_eq!(team.step(&SweepPlace::default(), &[][..]), Err(StepError::Sweep(SweepError::Pose)));
}
