//! Choices that the dissertation's text leaves open, by preset. Covered here are those that core's
//! own tests do not cover: these cover the clip (`grid`), the window that moves with the source
//! (`window`), smoothing, extra term, targets outside, ties and rounds (`flow`), gate and first
//! update (`tracklet::ekf`), deskew (`prepare`).

use raywake_core::params::{Frame, Profile};
use raywake_core::pose::{Pose, Twist};
use raywake_core::record::{Column, SweepUniform, ray_origin};
use raywake_core::stages::window::outside_cost;
use raywake_core::sweep::{Point, Rig, Timing};
use raywake_sim::SimSweep;
use raywake_tests::drives::Setup;
use raywake_tests::pair::{Side, Stages};
use std::f64::consts::FRAC_PI_2;

const PRESETS: [fn() -> Profile; 2] = [Profile::hdl64, Profile::dissertation];

fn rig(mounted: Pose) -> Rig {
    Rig {
        sensors: [mounted].into_iter().collect(),
        timing: Timing::AtStamp,
        distorted: false,
        ground_m: -1.73,
        own_vehicle: Some([[-1.5, -1.75], [4.5, 1.75]]),
    }
}

/// A quarter turn, so that the lattice's axes differ from the vehicle's.
fn heading() -> Pose {
    Pose::planar(0.0, 0.0, 0.0, FRAC_PI_2)
}

/// A sweep of some returns at rest, followed by an empty one that reveals its columns.
fn stages(profile: &Profile, mounted: Pose, points: &[[f32; 3]]) -> [Stages; 2] {
    let setup = Setup { profile: profile.clone(), rig: rig(mounted), filter: None };
    let point = |p: &[f32; 3]| Point { position: *p, ..Point::default() };
    let sweep = |stamp_s, points| SimSweep {
        stamp_s,
        points,
        truth: Vec::new(),
        world_from_vehicle: Pose::planar(7.0, -3.0, 0.4, 0.0) * heading(),
        twist: Twist::ZERO,
    };
    let first = sweep(0.0, points.iter().map(point).collect());
    let mut side = Side::new(&setup, setup.scalar());
    [side.step(&first, None), side.step(&sweep(0.1, Vec::new()), Some(&first))]
}

#[test]
fn rays_begin_at_the_sensor() {
    for preset in PRESETS {
        let mounted = Pose::planar(1.4, -0.5, 0.7, 0.3);
        let profile = preset();
        let [first, _] = stages(&profile, mounted, &[[10.0, 0.0, 0.0]]);
        let ray = [first.words("rays")[0], first.words("rays")[1]];
        let origin = &first.words("origins")[4 * ray_origin(ray)..][..3];
        // The vehicle frame's origin, 1.73 m above ground, lies at the centre of the window.
        let at = match profile.frame {
            Frame::Sensor => mounted.translation,
            Frame::Lattice => (heading() * mounted).translation,
        };
        let cell = |m: f64| (m / 0.3).round() as i32;
        let wanted = [83 + cell(at.x), 83 + cell(at.y), 7 + cell(at.z)].map(|v| v as u32);
        assert_eq!(origin, wanted, "{}", profile.name);
    }
}

/// Columns of the first sweep with free and with occupied voxels.
fn seen(stages: &[Stages; 2]) -> [usize; 2] {
    let columns: &[Column] = stages[1].words("shift").as_chunks::<2>().0;
    let count = |half: u32| columns.iter().filter(|c| c[0] >> half & 0xffff != 0).count();
    [count(0), count(16)]
}

/// Checks how many columns the ray to a return frees, and how many it occupies.
fn check_traced(case: &str, change: fn(Profile) -> Profile, point: [f32; 3], wanted: [usize; 2]) {
    for preset in PRESETS {
        let profile = change(preset());
        let found = seen(&stages(&profile, Pose::IDENTITY, &[point]));
        assert_eq!(found, wanted, "{case}, {}", profile.name);
    }
}

#[test]
fn rays_ending_outside_still_free_space() {
    let same = |p: Profile| p;
    let short = |p: Profile| Profile { range_m: 9.0, ..p };
    check_traced("a return", same, [12.0, 0.0, 0.0], [40, 1]);
    check_traced("outside the window", same, [40.0, 0.0, 0.0], [84, 0]);
    check_traced("beyond the range", short, [12.0, 0.0, 0.0], [30, 0]);
    check_traced("on the own vehicle", same, [3.0, 0.0, 0.0], [10, 0]);
    let medium = |p: Profile| Profile { range_m: 30.0, ..p };
    check_traced("beyond window and range", medium, [90.0, 0.0, 0.0], [84, 0]);
}

fn step_of(profile: &Profile) -> SweepUniform {
    stages(profile, Pose::IDENTITY, &[[12.0, 0.0, 0.0]])[0].step
}

#[test]
fn costs_of_a_preset() {
    for (preset, outside) in PRESETS.into_iter().zip([693, 17_289]) {
        let step = step_of(&preset());
        let last = (step.side * step.side) as usize - 1;
        // (i, j) of a corner lacks five neighbours, of an edge three, elsewhere none.
        for (column, missing) in [(0, 5), (last, 5), (1, 3), (step.side as usize, 3), (last / 2, 0)]
        {
            assert_eq!(outside_cost(&step, column), missing * outside);
        }
        assert_eq!((step.smoothing, step.displacement_cost), (1000, 1));
    }
}
