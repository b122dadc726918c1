//! Recordings without poses, from the user's side.

#[allow(dead_code)]
mod common;

use common::{Outcome, Temp, raywake};
use raywake_core::pose::Pose;
use raywake_io::source::pose_row;
use raywake_sim::{Drive, Ego, Options};

const SWEEPS: usize = 6;

/// Writes a folder of clouds. Returns their poses relative to the first one.
fn recording(t: &Temp, sweeps: usize) -> Vec<Pose> {
    let ego = Ego::Straight { speed: 9.0 };
    let drive = Drive::new(3, Options { sweeps, ego, ..Options::default() });
    let mut poses = Vec::new();
    for (n, sweep) in drive.into_iter().enumerate() {
        let rows = sweep.points.iter().flat_map(|p| [p.position.as_slice(), &[0.5]].concat());
        t.write(&format!("clouds/{n:02}.bin"), rows.flat_map(f32::to_le_bytes).collect::<Vec<_>>());
        poses.push(sweep.world_from_vehicle);
    }
    poses.iter().map(|pose| poses[0].inverse() * *pose).collect()
}

fn digest(o: &Outcome) -> String {
    o.stdout.lines().find(|l| l.starts_with("digest")).expect("a digest").to_string()
}

#[test]
fn poses_are_found_and_useful() {
    let t = Temp::new();
    let truth = recording(&t, SWEEPS)[SWEEPS - 1];
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
    assert!(given.stdout.contains("the poses are used"), "{}", given.stdout);
    assert!(!given.stdout.contains("registration:"), "{}", given.stdout);
    let trusted = run(&["--poses", &poses, "--trust-poses"]);
    assert!(!trusted.stdout.contains("poses:"), "{}", trusted.stdout);
    assert_eq!(digest(&given), digest(&trusted));
}

/// Poses that alternate by 3 cm are replaced; those that slip are not.
/// They belong to the sweeps they were found for.
#[cfg(feature = "arrow")]
#[test]
fn poses_of_a_part() {
    let t = Temp::new();
    recording(&t, SWEEPS);
    let [clouds, poses, out] =
        ["clouds", "poses.txt", "out"].map(|n| t.path().join(n).display().to_string());
    raywake(&["odometry", &clouds, "--out", &poses, "--sweeps", "2..5"]).succeeded();
    raywake(&["run", &clouds, "--poses", &poses, "--backend", "scalar", "--out", &out]).succeeded();
    let tables = std::fs::read_dir(t.path().join("out/columns")).unwrap();
    let mut names: Vec<_> = tables.map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["0000000002.feather", "0000000003.feather"]);
}

#[test]
fn given_poses() {
    let t = Temp::new();
    let truth = recording(&t, 14);
    let run = |name: &str, off_m: &dyn Fn(usize) -> f64, more: &[&str]| {
        let off = |n: usize| Pose::planar(off_m(n), 0.0, 0.0, 0.0);
        let rows: String =
            (0..14).map(|n| format!("{}\n", pose_row(&(truth[n] * off(n))))).collect();
        let poses = t.write(name, rows).display().to_string();
        let clouds = t.path().join("clouds").display().to_string();
        let all = [&["run", &clouds, "--backend", "scalar", "--poses", &poses], more].concat();
        let o = raywake(&all);
        o.succeeded();
        o
    };
    let good = run("good.txt", &|_| 0.0, &[]);
    assert!(good.stdout.contains("the poses are used"), "{}", good.stdout);
    let noisy = |n: usize| if n.is_multiple_of(2) { 0.015 } else { -0.015 };
    let poor = run("poor.txt", &noisy, &[]);
    let words = "as the poses jitter: 4 steps are from registration";
    assert!(
        poor.stdout.contains(words) && poor.stdout.contains("13 sweeps located"),
        "{}",
        poor.stdout
    );
    let few = run("poor.txt", &noisy, &["-n", "6"]);
    assert!(few.stdout.contains("too few to judge: the poses are used"), "{}", few.stdout);
    let kept = run("poor.txt", &noisy, &["--trust-poses"]);
    assert!(!kept.stdout.contains("registration"), "{}", kept.stdout);
    assert_ne!(digest(&poor), digest(&kept));
    let slipping = run("slipping.txt", &|n| 0.05 * n as f64, &[]);
    assert!(slipping.stdout.contains("one direction: the poses are used"), "{}", slipping.stdout);
}

#[test]
fn unusable_arguments() {
    let t = Temp::new();
    recording(&t, 1);
    let [clouds, absent] = ["clouds", "absent"].map(|n| t.path().join(n).display().to_string());
    raywake(&["odometry", &absent, "--out", "poses.txt"]).failed(3, &["absent"]);
    let below = t.path().join("clouds/00.bin/poses.txt").display().to_string();
    raywake(&["odometry", &clouds, "--out", &below]).failed(4, &["poses.txt"]);
    raywake(&["odometry", &clouds]).failed(2, &["--out"]);
}
