//! The record of a point of a cloud.

use bytemuck::{Pod, Zeroable};

/// Flow of a point of the first cloud.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct FlowRecord {
    /// Where it is in the second cloud's frame less where it is in the first one's, m.
    pub flow_m: [f32; 3],
    /// Motion over ground along the axes of the first cloud, m.
    pub motion_m: [f32; 3],
    /// Covariance of the motion (xx, xy, yy), m^2.
    pub covariance: [f32; 3],
    /// What became of it.
    pub status: u8,
    /// Whence the flow.
    pub basis: u8,
    /// 0.
    pub reserved: [u8; 2],
}
