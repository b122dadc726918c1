//! Which way the surface that a return lies on faces, from the returns around it.
//!
//! Their covariance plus their noise is that of generalised ICP (Segal, Haehnel and Thrun,
//! "Generalized-ICP", RSS 2009), for one cloud alone: a return counts across its surface, little
//! along it, so that rings of returns on a bonnet, which move with the sensor, do not hold a car.

use super::places::Moments;
use super::sample::SurfaceWeight;
use super::scaled::Scaled;
use core::sync::atomic::AtomicU32;
use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use nalgebra::Matrix3;

/// A packed weight, all zero until first requested. Threads that request it at the same time
/// compute the same. Few are requested: computing all of them took 9 % more processor time per
/// sweep (KITTI drive 0005, 60 sweeps, scalar, `user` of `time`: 4.11 s against 3.77 s).
pub struct LazyWeight([AtomicU32; 3]);

impl LazyWeight {
    pub const fn unknown() -> LazyWeight {
        LazyWeight([const { AtomicU32::new(0) }; 3])
    }

    /// The weight, computed by `find` if it is not known yet.
    pub fn get(&self, find: impl FnOnce() -> SurfaceWeight) -> SurfaceWeight {
        // The first word of a known weight is not zero. It is written last and read first.
        let [first, rest @ ..] = &self.0;
        let known = first.load(Acquire);
        if known != 0 {
            let [b, c] = rest.each_ref().map(|bits| bits.load(Relaxed));
            return unpacked([known, b, c]);
        }
        let [known, more @ ..] = packed(find());
        rest.iter().zip(more).for_each(|(to, bits)| to.store(bits, Relaxed));
        first.store(known, Release);
        unpacked([known, more[0], more[1]])
    }
}

/// Quantisation steps of a weight, which is at most 1.
const STEPS: f32 = 32_767.0;

/// A weight in steps, two per word. The first is positive.
fn packed(weight: SurfaceWeight) -> [u32; 3] {
    let [xx, steps @ ..] = weight.map(|w| u32::from((w * STEPS) as i16 as u16));
    let [xy, xz, yy, yz, zz] = steps;
    [xx.max(1) | xy << 16, xz | yy << 16, yz | zz << 16]
}

fn unpacked(words: [u32; 3]) -> SurfaceWeight {
    let [a, b, c] =
        words.map(|w| [w as u16, (w >> 16) as u16].map(|s| f32::from(s as i16) / STEPS));
    [a[0], a[1], b[0], b[1], c[0], c[1]]
}

/// The weight of a return from the sums over the returns within a radius around it.
pub fn weight(scaled: &Scaled, sums_within: impl Fn(f32) -> Moments) -> SurfaceWeight {
    let mut spread = covariance(sums_within(scaled.surface_radius));
    // A line, such as from a single ring, would hold a cluster along the surface as well as across.
    if across(&spread) < scaled.surface_line {
        spread = covariance(sums_within(scaled.surface_radius_wide));
    }
    // The noise makes it positive definite.
    let variance = scaled.return_sigma * scaled.return_sigma;
    let noise = Matrix3::from_diagonal_element(variance);
    let w = (spread + noise).try_inverse().unwrap_or_default() * variance;
    [w[(0, 0)], w[(0, 1)], w[(0, 2)], w[(1, 1)], w[(1, 2)], w[(2, 2)]]
}

/// Covariance of places, voxels².
fn covariance([n, x, y, z, square @ ..]: Moments) -> Matrix3<f32> {
    let [x, y, z] = [x, y, z].map(|m| m / n);
    let products = [x * x, x * y, x * z, y * y, y * z, z * z];
    let [xx, xy, xz, yy, yz, zz] = core::array::from_fn(|k| square[k] / n - products[k]);
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Variance across the longest direction, voxels²: the middle eigenvalue if the smallest is small.
fn across(spread: &Matrix3<f32>) -> f32 {
    let minor =
        |a: usize, b: usize| spread[(a, a)] * spread[(b, b)] - spread[(a, b)] * spread[(b, a)];
    let trace = spread.trace();
    if trace > 0.0 { (minor(0, 1) + minor(0, 2) + minor(1, 2)) / trace } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Profile;

    #[test]
    fn weights_are_kept_to_within_a_step() {
        for weight in [[1.0, -0.5, 0.25, 0.7, 0.5, 1.0], [0.0, 0.0, -1.0, 1.0, 1e-6, 0.3]] {
            let words = packed(weight);
            assert!(words[0] != 0, "known");
            for (kept, given) in unpacked(words).into_iter().zip(weight) {
                assert!((kept - given).abs() <= 1.0 / STEPS, "{kept} {given}");
            }
        }
    }

    #[test]
    fn lines_are_distinguished_from_surfaces() {
        let line = Scaled::new(&Profile::hdl64()).surface_line;
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1);
        let turned = |variances: [f32; 3]| {
            let spread = Matrix3::from_diagonal(&variances.into());
            across(&(turn * spread * turn.inverse()))
        };
        // One ring with its noise, two rings 0.3 m apart, a single return.
        assert!(turned([0.5, 0.005, 0.005]) < line);
        assert!(turned([0.5, 0.25, 0.005]) > line);
        assert!(turned([0.0; 3]) < line);
    }
}
