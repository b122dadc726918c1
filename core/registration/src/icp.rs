//! Point-to-plane ICP (Chen and Medioni 1992): the rigid motion between two clouds.
//!
//! Points are matched to their nearest neighbours, the residual is the distance along the target's
//! normal, Geman and McClure's kernel discounts moving objects, and Gauss-Newton steps find the
//! motion. Kernel and search radius shrink over three levels, so that it can start far off.

use crate::cloud::OrientedCloud;
use crate::gauss_newton::{Correspondence, UnobservableMotions, solve};
use crate::tree;
use raywake_core::pose::Pose;

/// A good number of correspondences for [`register`]. Not tuned separately.
pub const CORRESPONDENCES: usize = 6000;

/// How to register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IcpOptions {
    /// Maximum distance of matched points at first, m: how far the unknown part of the motion may
    /// displace points. The later levels use a half and a quarter of it.
    pub distance_m: f64,
    /// Residual at which a correspondence counts a quarter in the last level, m; the earlier ones
    /// use eight times and three times as much.
    pub kernel_m: f64,
    /// Maximum number of steps of each level.
    pub iterations: usize,
}

impl IcpOptions {
    /// For motions that are uncertain by up to 3 m and 5 degrees. The dissertation's search radius
    /// is also 3 m.
    pub const DEFAULT: IcpOptions = IcpOptions { distance_m: 3.0, kernel_m: 0.1, iterations: 30 };
}

/// The result of a registration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// `target_from_source`; always finite. The initial pose if nothing could be matched.
    pub pose: Pose,
    /// Whether the steps died out in the last level with enough correspondences. If not, the pose
    /// is not to be trusted.
    pub converged: bool,
    /// Number of steps over all levels.
    pub iterations: usize,
    /// Root mean square distance of the inliers from their planes, m; 0 without any.
    pub rms_m: f64,
    /// Number of correspondences of the last step whose residual is below the kernel's width.
    pub inliers: usize,
    /// Their share (0..1) of the source's points that were to be matched: how much of one cloud the
    /// other one shows.
    pub overlap: f64,
    /// Smallest eigenvalue of the normal matrix (dimensionless, at most 1/3): zero if some motion
    /// changes no residual.
    pub least_eigenvalue: f64,
    /// Motions that the clouds do not determine (a plane leaves three): in those the pose keeps the
    /// initial value.
    pub unobservable: UnobservableMotions,
}

impl Registration {
    pub(crate) fn unmatched(pose: Pose) -> Registration {
        Registration {
            pose,
            converged: false,
            iterations: 0,
            rms_m: 0.0,
            inliers: 0,
            overlap: 0.0,
            least_eigenvalue: 0.0,
            unobservable: UnobservableMotions::ALL,
        }
    }
}

/// Minimum number of correspondences that determine a motion.
pub(crate) const CORRESPONDENCES_MIN: usize = 30;
/// A step that changes the residuals by less than this ends a level, m (root mean square). The pose
/// itself may not settle: if little determines a motion, such as height without ground, points that
/// keep switching neighbours move it back and forth for ever.
const SETTLED_M: f64 = 2e-4;
/// Motions with a smaller eigenvalue are indistinguishable from noise in the normals.
pub(crate) const OBSERVABLE: f64 = 2e-3;
/// Matched normals are at most 45 degrees apart (cosine).
const ALIGNED: f64 = 0.7;

/// One of the levels from coarse to fine.
struct Level {
    /// Search radius, m.
    radius_m: f64,
    /// Width of the kernel, m.
    kernel_m: f64,
    /// Stride at which the source's flat points are matched.
    stride: usize,
}

/// Share of the search radius, multiple of the kernel and multiple of the stride of each level. Not
/// tuned separately.
const LEVELS: [(f64, f64, usize); 3] = [(1.0, 8.0, 4), (0.5, 3.0, 2), (0.25, 1.0, 1)];

/// Finds the motion that aligns `source` with `target`, starting at `initial`
/// (`target_from_source`). At most as many points are matched as `correspondences` has room for,
/// evenly chosen; [`CORRESPONDENCES`] is a good number.
///
/// Never fails: clouds without enough flat patches, or an initial pose that is not finite (then
/// taken as the identity), give `converged: false`.
pub fn register(
    source: &OrientedCloud,
    target: &OrientedCloud,
    initial: Pose,
    options: &IcpOptions,
    correspondences: &mut [Correspondence],
) -> Registration {
    if !(initial.rotation.is_finite() && initial.translation.is_finite()) {
        return Registration::unmatched(Pose::IDENTITY);
    }
    let mut result = Registration::unmatched(initial);
    let stride = source.normal_count().div_ceil(correspondences.len().max(1)).max(1);
    for (radius, kernel, every) in LEVELS {
        let level = Level {
            radius_m: radius * options.distance_m,
            kernel_m: kernel * options.kernel_m,
            stride: every * stride,
        };
        result.converged = false;
        let mut matched = 0;
        for _ in 0..options.iterations {
            matched = match_points(source, target, &result.pose, &level, correspondences);
            if !result.advance(&correspondences[..matched], &initial) {
                break;
            }
        }
        let tried = source.normal_count().div_ceil(level.stride);
        result.evaluate(&correspondences[..matched], tried, level.kernel_m);
    }
    result.converged &= result.inliers >= CORRESPONDENCES_MIN && result.unobservable.count() < 6;
    result
}

/// Matches the source's flat points with the planes of their nearest neighbours. Returns the number
/// of `correspondences`.
fn match_points(
    source: &OrientedCloud,
    target: &OrientedCloud,
    pose: &Pose,
    level: &Level,
    correspondences: &mut [Correspondence],
) -> usize {
    let rotation = pose.matrix();
    let flat = source.points().iter().filter(|p| p.is_flat()).step_by(level.stride);
    let found = flat.filter_map(|of| {
        let point = rotation * of.position + pose.translation;
        let near = tree::nearest(target.points(), point, level.radius_m * level.radius_m)?;
        let on = &target.points()[near];
        if on.normal.dot(rotation * of.normal).abs() < ALIGNED {
            return None;
        }
        let (on, normal) = (on.position, on.normal);
        let mut found = Correspondence { point, on, normal, weight: 1.0 };
        found.weight = geman_mcclure(found.residual() / level.kernel_m);
        Some(found)
    });
    correspondences.iter_mut().zip(found).map(|(slot, found)| *slot = found).count()
}

/// Weight of a residual in units of the kernel's width (Geman and McClure 1985).
pub(crate) fn geman_mcclure(ratio: f64) -> f64 {
    let q = 1.0 + ratio * ratio;
    1.0 / (q * q)
}

impl Registration {
    /// Takes one step. Returns whether another one may follow.
    pub(crate) fn advance(&mut self, correspondences: &[Correspondence], initial: &Pose) -> bool {
        if correspondences.len() < CORRESPONDENCES_MIN {
            return false;
        }
        let done = self.pose * initial.inverse();
        let Some(step) = solve(correspondences, &done, OBSERVABLE) else { return false };
        self.pose = step.motion * self.pose;
        self.iterations += 1;
        self.least_eigenvalue = step.least_eigenvalue;
        self.unobservable = step.unobservable;
        self.converged = step.change_m < SETTLED_M;
        !self.converged
    }

    /// Determines the number of inliers, their share of the points tried, and how far they are off.
    pub(crate) fn evaluate(
        &mut self,
        correspondences: &[Correspondence],
        tried: usize,
        kernel_m: f64,
    ) {
        let squares = correspondences.iter().map(|c| c.residual() * c.residual());
        let inliers = squares.filter(|r2| *r2 < kernel_m * kernel_m);
        let (count, sum) = inliers.fold((0, 0.0), |(n, sum), r2| (n + 1, sum + r2));
        self.inliers = count;
        self.overlap = count as f64 / tried.max(1) as f64;
        self.rms_m = libm::sqrt(sum / count.max(1) as f64);
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
