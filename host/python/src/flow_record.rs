//! The record of a point of a cloud.

use bytemuck::{Pod, Zeroable};

/// Flow of a point of the first cloud.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct FlowRecord {
    /// Its position in the second cloud's frame minus that in the first one's, m.
    pub flow_m: [f32; 3],
    /// Motion over ground along the axes of the first cloud, m.
    pub motion_m: [f32; 3],
    /// Covariance of the motion (xx, xy, yy), m^2.
    pub covariance: [f32; 3],
    /// Outcome, as in POINT_DTYPE.
    pub status: u8,
    /// Source of the flow.
    pub basis: u8,
    /// Always 0.
    pub reserved: [u8; 2],
}
