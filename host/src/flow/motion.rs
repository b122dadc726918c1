//! The motion of the sensor from one cloud to the next, and its report.

use glam::{DVec3, EulerRot};
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig};
use raywake_registration::deskew::{TimedPoint, thin_sweep};
use raywake_registration::multi_start::OVERLAP_MIN;
use raywake_registration::{
    CORRESPONDENCES, Correspondence, OrientedCloud, OrientedPoint, Registration,
    register_multi_start,
};

/// Estimates the pose of the second cloud's frame in the first one's, and describes it; or returns
/// why there is none.
pub fn find([first, second]: [&[Point]; 2], rig: &Rig) -> Result<(Pose, String), String> {
    let (mut target, mut source) = (surface(first, rig), surface(second, rig));
    let (target, source) = std::thread::scope(|scope| {
        let source = scope.spawn(|| OrientedCloud::new(&mut source));
        let target = OrientedCloud::new(&mut target);
        (target, source.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    let mut correspondences = vec![Correspondence::default(); CORRESPONDENCES];
    let best = register_multi_start(&source, &target, &mut correspondences);
    if best.is_accepted() { Ok((best.pose, report(&best))) } else { Err(refusal(&best)) }
}

/// Returns a known pose, and a line about it.
pub fn given(pose: Pose) -> (Pose, String) {
    (pose, format!("motion     {} (given)\n", describe(&pose)))
}

/// The returns that registration uses.
fn surface(points: &[Point], rig: &Rig) -> Vec<OrientedPoint> {
    let mut storage = vec![TimedPoint::default(); points.len()];
    let thinned = thin_sweep(points, rig, &mut storage);
    thinned.iter().map(|p| p.at_stamp(&Twist::ZERO).into()).collect()
}

fn refusal(best: &Registration) -> String {
    let share = 100.0 * best.overlap;
    let why = match best {
        r if r.iterations == 0 => "too few planar patches are within 3 m of each other".into(),
        r if r.overlap < OVERLAP_MIN => {
            format!("the clouds overlap by no more than {share:.0} %")
        }
        r if r.unobservable.planar > 0 => format!(
            "the scene, like a single wall, a tunnel or bare ground, leaves {} of the 3 degrees of \
             freedom on the ground undetermined",
            r.unobservable.planar
        ),
        r => format!("no convergence in {} iterations", r.iterations),
    };
    format!(
        "cannot be registered to the first cloud: {why}; if the motion is known, pass it with \
         --pose"
    )
}

fn report(r: &Registration) -> String {
    let mut text = format!(
        "motion     {}\n           overlap {:.0} %, {} inliers, rms {:.1} cm, {} iterations\n",
        describe(&r.pose),
        100.0 * r.overlap,
        r.inliers,
        100.0 * r.rms_m,
        r.iterations,
    );
    if r.unobservable.upright > 0 {
        text += &format!(
            "note: {} of height, roll and pitch not observable and assumed unchanged\n",
            r.unobservable.upright
        );
    }
    text
}

/// Formats a motion in metres and degrees.
fn describe(motion: &Pose) -> String {
    let DVec3 { x, y, z } = motion.translation;
    let (yaw, pitch, roll) = motion.rotation.to_euler(EulerRot::ZYX);
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
    format!(
        "x {x:.3}, y {y:.3}, z {z:.3} m; roll {roll:.2}, pitch {pitch:.2}, yaw {yaw:.2} degrees"
    )
}
