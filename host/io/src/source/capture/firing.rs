//! When lasers measured.

/// Largest reflectivity of a return; Ouster's profile `LEGACY` has larger ones.
pub(super) const REFLECTIVITY_MAX: f32 = 255.0;
/// Number of angles in a revolution.
pub(super) const TURN: u64 = 1 << 16;

/// When a sensor's lasers measured, all of them at one angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Firing {
    /// By the sensor's clock, ns.
    pub clock_ns: u64,
    /// From the rear, clockwise.
    pub angle: u16,
    /// Number of the revolution, if the sensor counts them.
    pub frame: Option<u16>,
}
