#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Scan matching: the rigid motion between two clouds of one sensor, and the ground below.
//!
//! Section 3.8.3 of the dissertation takes the vehicle's motion from scan matching (generalised
//! ICP, Segal, Haehnel and Thrun 2009). Here it is point-to-plane ICP (Chen and Medioni 1992) with
//! Geman and McClure's kernel, from coarse to fine and, if needed, from several starts.
//!
//! | module | subject |
//! |---|---|
//! | [`deskew`] | voxel thinning of a sweep; its returns moved to the stamp |
//! | [`cloud`] | points in k-d tree order, with normals |
//! | [`icp`] | point-to-plane ICP from one initial pose |
//! | [`multi_start`] | ICP from several initial poses; when a result is accepted |
//! | [`odometry`] | the trajectory of a vehicle from its sweeps alone |
//! | [`ground`] | height of the ground around the sensor |
//!
//! Nothing is allocated: all storage is slices owned by the caller. Nothing is random or depends on
//! threads: the same input gives the same bits. Lengths are in metres, angles in radians.

#[cfg(test)]
extern crate std;

pub mod cloud;
pub mod deskew;
mod gauss_newton;
pub mod ground;
pub mod icp;
mod moments;
pub mod multi_start;
pub mod odometry;
mod point;
mod tree;

pub use cloud::OrientedCloud;
pub use gauss_newton::{Correspondence, UnobservableMotions};
pub use icp::{CORRESPONDENCES, IcpOptions, Registration, register};
pub use multi_start::register_multi_start;
pub use odometry::Odometry;
pub use point::OrientedPoint;

/// Moves the items to keep to the front, preserving their order. Returns their number.
fn compact<T: Copy>(items: &mut [T], mut keep: impl FnMut(&T) -> bool) -> usize {
    let mut kept = 0;
    for n in 0..items.len() {
        let item = items[n];
        if keep(&item) {
            items[kept] = item;
            kept += 1;
        }
    }
    kept
}
