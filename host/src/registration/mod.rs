//! Registration of clouds: the rigid motion between them.
//!
//! The ground truth of section 3.8.3 takes the vehicle's motion from scan matching (generalised
//! ICP, Segal, Haehnel and Thrun 2009). Here points are matched to planes: nearest neighbours in a
//! k-d tree, the residual along the target's normal, Geman and McClure's kernel against what moves,
//! steps of Gauss and Newton. Kernel and search radius shrink in three stages, so that it can start
//! far off. Same input, same bits: nothing is random and nothing depends on threads.

mod cloud;
mod deskew;
mod eigen;
mod step;
mod tree;

pub use cloud::{Cloud, thin};
pub use deskew::{Thinned, VOXEL_M, span_s};

use raywake_core::pose::Pose;
use step::{Pair, solve};

/// How to register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Farthest that matched points lie apart at first, m: what the unknown part of the motion may
    /// displace points by. The later stages have a half and a quarter of it.
    pub distance_m: f64,
    /// Residual at which a pair counts a quarter in the last stage, m; the earlier ones have eight
    /// times and three times of it.
    pub kernel_m: f64,
    /// Steps of each stage at most.
    pub iterations: usize,
    /// Points of the source that are matched at most, evenly chosen.
    pub points: usize,
}

impl Default for Options {
    /// Motions that are unknown up to 3 m and 5 degrees. The author's search radius is 3 m, too.
    fn default() -> Options {
        Options { distance_m: 3.0, kernel_m: 0.1, iterations: 30, points: 6000 }
    }
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// `target_from_source`; always finite. Where nothing could be matched, the initial one.
    pub pose: Pose,
    /// Whether the steps died out in the last stage with pairs enough. Otherwise the pose is not to
    /// be trusted.
    pub converged: bool,
    /// Steps of all stages.
    pub iterations: usize,
    /// Root mean square distance of the inliers from their planes, m; 0 without any.
    pub rms: f64,
    /// Pairs of the last step whose residual is below the kernel's width.
    pub inliers: usize,
    /// Their share (0..1) of the source's points that were to be matched: how much of the one cloud
    /// the other one shows.
    pub overlap: f64,
    /// Least eigenvalue of the normal matrix (dimensionless, at most 1/3): zero where some motion
    /// leaves every residual alone.
    pub least_eigenvalue: f64,
    /// Independent motions that the clouds do not tell (a plane leaves three open): in those the
    /// pose keeps what the initial one has.
    pub unobserved: usize,
}

/// Fewest pairs that tell a motion.
const PAIRS_MIN: usize = 30;
/// A step shorter than this ends a stage, m.
const SETTLED_M: f64 = 2e-4;
/// Motions with a smaller eigenvalue are not told apart from noise of the normals.
const OBSERVABLE: f64 = 2e-3;
/// Matched normals are at most 45 degrees apart (cosine).
const ALIGNED: f64 = 0.7;
/// Share of the search radius, multiple of the kernel and every how manieth point of a stage.
const STAGES: [(f64, f64, usize); 3] = [(1.0, 8.0, 4), (0.5, 3.0, 2), (0.25, 1.0, 1)];

/// The motion that lays `source` onto `target`, started at `initial` (`target_from_source`).
///
/// Never fails: clouds without enough flat patches, or an initial pose that is not finite (then
/// taken as the identity), give `converged: false`.
pub fn register(source: &Cloud, target: &Cloud, initial: Pose, options: &Options) -> Registration {
    let finite = initial.rotation.is_finite() && initial.translation.is_finite();
    let mut result = Registration {
        pose: if finite { initial } else { Pose::IDENTITY },
        converged: false,
        iterations: 0,
        rms: 0.0,
        inliers: 0,
        overlap: 0.0,
        least_eigenvalue: 0.0,
        unobserved: 6,
    };
    if !finite {
        return result;
    }
    let mut pairs = Vec::new();
    for (radius, width, every) in STAGES {
        let kernel_m = width * options.kernel_m;
        let stride = every * source.flat.len().div_ceil(options.points.max(1)).max(1);
        let radius_m = radius * options.distance_m;
        result.converged = false;
        for _ in 0..options.iterations {
            match_points(source, target, &result.pose, radius_m, stride, kernel_m, &mut pairs);
            if pairs.len() < PAIRS_MIN {
                break;
            }
            let Some(step) = solve(&pairs, OBSERVABLE) else { break };
            result.pose = step.motion * result.pose;
            result.iterations += 1;
            result.least_eigenvalue = step.least_eigenvalue;
            result.unobserved = step.unobserved;
            if step.length_m < SETTLED_M {
                result.converged = true;
                break;
            }
        }
        judge(&pairs, source.flat.len().div_ceil(stride), kernel_m, &mut result);
    }
    result.converged &= result.inliers >= PAIRS_MIN && result.unobserved < 6;
    result
}

/// Pairs every `stride`-th flat point of the source with the plane of its nearest neighbour.
fn match_points(
    source: &Cloud,
    target: &Cloud,
    pose: &Pose,
    radius_m: f64,
    stride: usize,
    kernel_m: f64,
    pairs: &mut Vec<Pair>,
) {
    pairs.clear();
    let rotation = pose.matrix();
    for place in source.flat.iter().step_by(stride) {
        let point = rotation * source.tree.points()[*place] + pose.translation;
        let Some((near, _)) = target.tree.nearest(point, radius_m * radius_m) else { continue };
        let normal = target.normals[near];
        if normal.dot(rotation * source.normals[*place]).abs() < ALIGNED {
            continue;
        }
        let mut pair = Pair { point, on: target.tree.points()[near], normal, weight: 1.0 };
        let ratio = pair.residual() / kernel_m;
        pair.weight = (1.0 + ratio * ratio).powi(-2);
        pairs.push(pair);
    }
}

/// Counts the inliers, also as a share of the points tried, and how far they are off.
fn judge(pairs: &[Pair], tried: usize, kernel_m: f64, result: &mut Registration) {
    let squares = pairs.iter().map(|p| p.residual().powi(2)).filter(|r2| *r2 < kernel_m * kernel_m);
    let (count, sum) = squares.fold((0, 0.0), |(n, sum), r2| (n + 1, sum + r2));
    result.inliers = count;
    result.overlap = count as f64 / tried.max(1) as f64;
    result.rms = (sum / count.max(1) as f64).sqrt();
}

#[cfg(test)]
mod tests;
