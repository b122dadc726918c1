#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Object tracks with shape (chapter 2): estimates an object's trajectory and shape from its
//! returns, jointly and in continuous time.
//!
//! A track has an anchor, a point in the world near its birth, and a start, the time of its birth.
//! Positions of a track are metres from its anchor along the world's axes (z up), times seconds
//! after its start: single precision then suffices wherever and whenever one drives.

pub mod centroid_ekf;
pub mod estimate;
pub mod front_end;
pub mod noise;
pub mod object_box;
pub mod panorama;
pub mod params;
#[cfg(test)]
#[path = "../../src/random.rs"]
mod random;
pub mod spline;
pub mod tracked;

/// Maximum number of returns that a track keeps and an estimate uses.
pub const RETURNS_MAX: usize = 8192;

/// One return of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectReturn {
    /// Where the ray ended, m from the track's anchor.
    pub position: [f32; 3],
    /// Where the ray began, m from the track's anchor.
    pub origin: [f32; 3],
    /// Time, s after the track's start.
    pub time_s: f32,
    /// Sensor that saw it: index in [`raywake_core::sweep::Rig::sensors`].
    pub sensor: u8,
    /// Whether the neighbouring rays pass it, on its left and on its right as the sensor sees it:
    /// the object ends there. See [`panorama`].
    pub passed: [bool; 2],
}

/// State of an object at a time (2.2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectState {
    /// Time, s after the track's start.
    pub time_s: f64,
    /// Origin of the object's frame, m from the track's anchor.
    pub position: [f64; 3],
    /// Direction of its x axis about +z, rad, unwrapped: it never jumps by a full turn along a
    /// track.
    pub heading: f64,
    /// Speed along its x axis, m/s.
    pub speed: f64,
    /// Speed upwards, m/s.
    pub climb: f64,
    /// Turning rate, rad/s.
    pub turn_rate: f64,
}

impl ObjectState {
    /// Converts a point, m from the track's anchor, to the frame of the object.
    pub fn local(&self, at: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = [0, 1, 2].map(|a| f64::from(at[a]) - self.position[a]);
        let (sin, cos) = libm::sincos(self.heading);
        [cos * x + sin * y, cos * y - sin * x, z].map(|v| v as f32)
    }

    /// Converts a point in the frame of the object to m from the track's anchor.
    pub fn placed(&self, at: [f32; 3]) -> [f64; 3] {
        let [x, y, z] = at.map(f64::from);
        let (sin, cos) = libm::sincos(self.heading);
        let [px, py, pz] = self.position;
        [px + cos * x - sin * y, py + sin * x + cos * y, pz + z]
    }
}

/// Wraps an angle to within half a turn of zero.
pub fn wrap_angle(angle: f64) -> f64 {
    angle - core::f64::consts::TAU * libm::round(angle / core::f64::consts::TAU)
}
