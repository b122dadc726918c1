//! First trajectories of steady motion, and of motion that is steady for a while at a time.
//!
//! Gauss-Newton only descends to a nearby minimum, so an estimate has three starts: the tracker's
//! history, grown from the middle of the track; one steady motion for the whole track; and motions
//! that are steady for [`SearchParams::unsteady_s`](super::params::SearchParams) each. Each is
//! solved, and the solution of least cost, endpoints included, is kept. In practice that is where a
//! descent from the true trajectory ends too.

use super::params::EstimateParams;
use super::problem::Problem;
use super::velocity_search::{SteadyMotion, VelocitySearch, within};
use crate::wrap_angle;

/// Minimum time between motions for interpolation, s.
const STEP_MIN_S: f64 = 1e-3;
/// Maximum number of steady parts of a track.
const PARTS_MAX: usize = 16;

/// Starts from the steady motion of all samples. False if they have none.
pub(super) fn start_steady(
    problem: &mut Problem,
    search: &mut VelocitySearch,
    params: &EstimateParams,
) -> bool {
    let length_m = problem.samples.length_m();
    let found = search.find(problem.samples.all(), length_m, &params.search);
    let Some(motion) = found else { return false };
    let ([x, y, z], [vx, vy]) = (motion.position, motion.velocity);
    let (heading, speed) = (libm::atan2(vy, vx), libm::hypot(vx, vy));
    let bases = problem.knots.bases();
    for (k, point) in problem.solution.control_points[..bases].iter_mut().enumerate() {
        let after = problem.knots.centre(k) - motion.time_s;
        *point = [x + after * vx, y + after * vy, z, heading, speed, 0.0, 0.0];
    }
    true
}

/// Starts from motion that is steady around each of several times: an object that brakes or turns
/// has no single velocity. False if there are fewer than two such times.
pub(super) fn start_unsteady(
    problem: &mut Problem,
    search: &mut VelocitySearch,
    params: &EstimateParams,
) -> bool {
    let found = steady_parts(problem, search, params);
    if found.len() < 2 {
        return false;
    }
    let anchor = found[found.len() / 2];
    let knots = problem.knots;
    let spacing = knots.spacing();
    let control_points = &mut problem.solution.control_points[..knots.bases()];
    let (mut heading, [mut x, mut y]) = (0.0, [0.0; 2]);
    let mut anchored = [0.0; 2];
    for (k, point) in control_points.iter_mut().enumerate() {
        let time = knots.centre(k);
        let [vx, vy] = velocity_at(&found, time);
        if k == 0 || libm::hypot(vx, vy) > params.smoothing.heading_speed_mps {
            heading += wrap_angle(libm::atan2(vy, vx) - heading);
        }
        let (sin, cos) = libm::sincos(heading);
        *point = [x, y, anchor.position[2], heading, cos * vx + sin * vy, 0.0, 0.0];
        let half = velocity_at(&found, time + 0.5 * spacing);
        let after = (anchor.time_s - time).clamp(0.0, spacing);
        anchored = [0, 1].map(|d| anchored[d] + after * half[d]);
        (x, y) = (x + spacing * half[0], y + spacing * half[1]);
    }
    for point in control_points {
        point[0] += anchor.position[0] - anchored[0];
        point[1] += anchor.position[1] - anchored[1];
    }
    true
}

/// Motions of the parts that have one, in order of time.
fn steady_parts(
    problem: &Problem,
    search: &mut VelocitySearch,
    params: &EstimateParams,
) -> heapless::Vec<SteadyMotion, PARTS_MAX> {
    let (first, last) = (problem.knots.start(), problem.knots.end());
    let part_s = params.search.unsteady_s;
    let count = (((last - first) / part_s) as usize).min(PARTS_MAX);
    let mut found = heapless::Vec::new();
    for n in 0..count {
        let middle = first + (last - first) * (n as f64 + 0.5) / count as f64;
        let part = within(problem.samples.all(), middle as f32, part_s as f32);
        found.extend(search.find(part, problem.samples.length_m(), &params.search));
    }
    found
}

/// Velocity at a time: linear between motions, that of the nearest one outside them.
fn velocity_at(motions: &[SteadyMotion], time: f64) -> [f64; 2] {
    let next = motions.partition_point(|motion| motion.time_s <= time);
    let (a, b) = (&motions[next.max(1) - 1], &motions[next.min(motions.len() - 1)]);
    let share = (time - a.time_s) / (b.time_s - a.time_s).max(STEP_MIN_S);
    [0, 1].map(|d| a.velocity[d] + share * (b.velocity[d] - a.velocity[d]))
}
