//! The motion of the sensor from one cloud to the next.

use glam::{DVec3, EulerRot};
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig};

use crate::registration::{Cloud, Options, Registration, Thinned, register};

/// Least share of a cloud's flat patches that must lie on the other's: of clouds of different
/// places it is below 0.32, of neighbours in a drive above 0.6 (KITTI and Argoverse 2, up to 4 m
/// apart).
const OVERLAP_MIN: f64 = 0.4;
/// What registration from no motion does not reach is started this far off, in four directions, m.
const AWAY_M: f64 = 5.0;
/// And turned by this much to both sides, rad.
const TURNED_RAD: f64 = 0.17;

/// The pose of the second cloud's frame in the first one's, and lines about it; or why there is
/// none.
pub fn find(points: [&[Point]; 2], rig: &Rig) -> Result<(Pose, String), String> {
    let [target, source] = clouds(points, rig);
    let mut best = register(&source, &target, Pose::IDENTITY, &Options::default());
    for start in starts() {
        if good(&best) {
            break;
        }
        let other = register(&source, &target, start, &Options::default());
        if good(&other) || other.overlap > best.overlap {
            best = other;
        }
    }
    if good(&best) { Ok((best.pose, report(&best))) } else { Err(refusal(&best)) }
}

/// A pose that is known beforehand, and a line about it.
pub fn given(pose: Pose) -> (Pose, String) {
    (pose, format!("motion     {} (given)\n", describe(&pose)))
}

/// Both clouds ready for registration, each on a thread of its own.
fn clouds(points: [&[Point]; 2], rig: &Rig) -> [Cloud; 2] {
    let cloud = |points| Cloud::new(Thinned::new(points, rig).at_stamp(&Twist::ZERO));
    std::thread::scope(|scope| {
        let second = scope.spawn(|| cloud(points[1]));
        let first = cloud(points[0]);
        [first, second.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))]
    })
}

/// Where to start beside no motion.
fn starts() -> impl Iterator<Item = Pose> {
    let places = [(0.0, 0.0), (AWAY_M, 0.0), (-AWAY_M, 0.0), (0.0, AWAY_M), (0.0, -AWAY_M)];
    let turned = move |yaw| places.map(|(x, y)| Pose::planar(x, y, 0.0, yaw));
    [0.0, TURNED_RAD, -TURNED_RAD].into_iter().flat_map(turned).skip(1)
}

fn good(found: &Registration) -> bool {
    found.converged && found.overlap >= OVERLAP_MIN
}

fn refusal(best: &Registration) -> String {
    let share = 100.0 * best.overlap;
    let why = match best {
        r if r.iterations == 0 => "too few flat patches are within 3 m of each other".into(),
        r if r.overlap < OVERLAP_MIN => {
            format!("at most {share:.0} % of the flat patches lie on each other")
        }
        r => format!("no place is settled on in {} steps", r.iterations),
    };
    format!(
        "cannot be laid onto the first cloud: {why}; give the motion with --pose if it is known"
    )
}

fn report(r: &Registration) -> String {
    let mut text = format!(
        "motion     {}\n           {:.0} % of the flat patches lie on each other, {} of them {:.1} cm \
         rms apart; {} steps\n",
        describe(&r.pose),
        100.0 * r.overlap,
        r.inliers,
        100.0 * r.rms,
        r.iterations,
    );
    if r.unobserved > 0 {
        text += &format!(
            "note: the clouds leave {} of 6 motions open, of which none is taken to have happened\n",
            r.unobserved
        );
    }
    text
}

/// Metres and degrees.
fn describe(motion: &Pose) -> String {
    let DVec3 { x, y, z } = motion.translation;
    let (yaw, pitch, roll) = motion.rotation.to_euler(EulerRot::ZYX);
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
    format!(
        "x {x:.3}, y {y:.3}, z {z:.3} m; roll {roll:.2}, pitch {pitch:.2}, yaw {yaw:.2} degrees"
    )
}
