//! What recordings hold, and objects as they are written.

/// What a recording is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The flow of every sweep.
    Flow,
    /// The objects in every sweep.
    Objects,
}

/// The box of an object in the world.
#[derive(Clone, Copy, Debug)]
pub struct BoxMark {
    /// Number of its track.
    pub id: u32,
    /// Its middle, m.
    pub centre: [f64; 3],
    /// Direction of its length about +z, rad.
    pub heading: f64,
    /// Length, width and height, m.
    pub size: [f32; 3],
    /// Whether it moves.
    pub moves: bool,
}
