//! Recordings without poses, as a user meets them.

#[allow(dead_code)]
mod common;

use common::{Outcome, Temp, raywake};
use raywake_core::pose::Pose;
use raywake_sim::{Drive, Ego, Options};

const SWEEPS: usize = 6;

/// A folder of clouds, and the way from the first to the last of them.
fn recording(t: &Temp) -> Pose {
    let ego = Ego::Straight { speed: 9.0 };
    let drive = Drive::new(3, Options { sweeps: SWEEPS, ego, ..Options::default() });
    let mut poses = Vec::new();
    for (n, sweep) in drive.into_iter().enumerate() {
        let rows = sweep.points.iter().flat_map(|p| [p.position.as_slice(), &[0.5]].concat());
        t.write(&format!("clouds/{n}.bin"), rows.flat_map(f32::to_le_bytes).collect::<Vec<_>>());
        poses.push(sweep.world_from_vehicle);
    }
    poses[0].inverse() * poses[SWEEPS - 1]
}

fn digest(o: &Outcome) -> String {
    o.stdout.lines().find(|l| l.starts_with("digest")).expect("a digest").to_string()
}

#[test]
fn poses_are_found_and_of_use() {
    let t = Temp::new();
    let truth = recording(&t);
    let [clouds, poses] = ["clouds", "poses.txt"].map(|n| t.path().join(n).display().to_string());
    let o = raywake(&["odometry", &clouds, "--out", &poses]);
    o.succeeded();
    assert!(o.stdout.contains("5 sweeps located, 0 degenerate, 0 lost"), "{}", o.stdout);
    let text = std::fs::read_to_string(&poses).unwrap();
    assert_eq!(text.lines().count(), SWEEPS);
    let last = text.lines().last().unwrap().split(' ').map(|w| w.parse().unwrap());
    let last = Pose::from_rows(&last.collect::<Vec<f64>>().try_into().unwrap()).unwrap();
    let off = (truth.inverse() * last).translation.length();
    assert!(off < 0.02, "{off} m of {} m", truth.translation.length());

    let run = |more: &[&str]| raywake(&[&["run", &clouds, "--backend", "scalar"], more].concat());
    let (without, register) = (run(&[]), run(&["--poses", "register"]));
    without.succeeded();
    assert!(without.stdout.contains("poses from registration"), "{}", without.stdout);
    assert_eq!(digest(&without), digest(&register));
    let given = run(&["--poses", &poses]);
    given.succeeded();
    assert!(!given.stdout.contains("registration:"), "{}", given.stdout);
}

#[test]
fn what_cannot_be() {
    let t = Temp::new();
    recording(&t);
    let [clouds, absent] = ["clouds", "absent"].map(|n| t.path().join(n).display().to_string());
    raywake(&["odometry", &absent, "--out", "poses.txt"]).failed(3, &["absent"]);
    let below = t.path().join("clouds/0.bin/poses.txt").display().to_string();
    raywake(&["odometry", &clouds, "--out", &below]).failed(4, &["poses.txt"]);
    raywake(&["odometry", &clouds]).failed(2, &["--out"]);
}
