//! The motion of the sensor from one cloud to the next.

use glam::{DVec3, EulerRot};
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig};

use crate::registration::{Cloud, Options, Registration, Thinned, register};

/// Least share of a cloud's flat patches that must lie on the other's: of clouds of different
/// places it is below 0.32, of sweeps 5 m apart above 0.5 (KITTI).
const OVERLAP_MIN: f64 = 0.4;
/// From this share on no better place is looked for: of neighbours in a drive it is above 0.65, of
/// a street displaced along itself below 0.5 (KITTI, Argoverse 2, simulated streets at 33 m/s).
const OVERLAP_SURE: f64 = 0.5;
/// What registration from no motion does not reach is started this far off, in four directions, m.
const AWAY_M: f64 = 5.0;
/// And turned by this much to both sides, rad.
const TURNED_RAD: f64 = 0.17;

/// The pose of the second cloud's frame in the first one's, and lines about it; or why there is
/// none.
pub fn find(points: [&[Point]; 2], rig: &Rig) -> Result<(Pose, String), String> {
    let [target, source] = clouds(points, rig);
    let mut best = register(&source, &target, Pose::IDENTITY, &Options::default());
    let sure = |r: &Registration| r.converged && r.overlap >= OVERLAP_SURE && r.unobserved == 0;
    let rank = |r: &Registration| (r.converged, r.overlap);
    for start in starts() {
        if sure(&best) {
            break;
        }
        let other = register(&source, &target, start, &Options::default());
        if rank(&other) > rank(&best) {
            best = other;
        }
    }
    let good = best.converged && best.overlap >= OVERLAP_MIN;
    if good { Ok((best.pose, report(&best))) } else { Err(refusal(&best)) }
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

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::{Drive, Ego, Options as Sim};

    /// A street looks like itself a few metres on; at 33 m/s and more no motion is a wrong answer
    /// that registration settles on.
    #[test]
    fn fast_along_a_street() {
        for (seed, speed) in [(2, 33.0), (8, 40.0)] {
            let options = Sim { sweeps: 2, ego: Ego::Straight { speed }, ..Sim::default() };
            let drive = Drive::new(seed, options);
            let [first, second] = [0, 1].map(|index| drive.sweep(index));
            let rig = Rig { distorted: false, ..drive.rig() };
            let (found, text) = find([&first.points, &second.points], &rig).unwrap();
            let truth = first.world_from_vehicle.inverse() * second.world_from_vehicle;
            let off = (truth.inverse() * found).twist(1.0);
            let (metres, degrees) = (off.linear.length(), off.angular.length().to_degrees());
            assert!(metres < 0.05 && degrees < 0.15, "{metres} m, {degrees} degrees: {text}");
        }
    }
}
