//! Objects as they are written.

use raywake_core::encoder::ColumnClass;
use raywake_objects::front_end::StateVariances;

/// An object at one of its sweeps: a box with a velocity, in the world.
#[derive(Clone, Debug, Default)]
pub struct TrackedObject {
    /// Number of its track.
    pub id: u32,
    /// Middle of the box around the returns of its last update, m.
    pub centre: [f64; 3],
    /// Direction of its length about +z, rad. Of what stands either end may be the front.
    pub heading: f64,
    /// Length, width and height, m.
    pub size: [f32; 3],
    /// Along x and y, m/s; none where it stands.
    pub velocity: Option<[f64; 2]>,
    /// About +z, rad/s.
    pub turn_rate: f64,
    /// How sure the filter is of it.
    pub variances: StateVariances,
    /// Mean P(moves) of its returns; none where the flow does not tell.
    pub p_moves: Option<f32>,
    /// What the encoder takes most of its returns for, and the share of them, 0 to 1.
    pub class: Option<(ColumnClass, f32)>,
    /// Its way so far, m.
    pub way: Vec<[f64; 3]>,
}
