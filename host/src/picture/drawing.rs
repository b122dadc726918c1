//! Drawing shared by all pictures.

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::source::SweepData;
use raywake_render::{Arrow, LegendEntry, Look, Sign, colours};

/// Width and height of a picture's panel, pixels.
const SIDE: f32 = 900.0;
/// The same for a film or page: 110 kB per sweep of 120,000 returns instead of 200.
pub(super) const FILM_SIDE: f32 = 600.0;
/// Height above the ground of the darkest returns, m.
const HEIGHT_M: f32 = 2.5;
/// An arrow is as long as the distance covered in this time, s.
const ARROW_S: f32 = 0.5;
/// Speed of the darkest colour, m/s: that of urban traffic.
const FAST_MPS: f32 = 15.0;
/// Width of an arrow, pixels.
pub(super) const WIDE: f32 = 1.7;

/// The look of a picture that extends this far, with cells of this width; m.
pub(super) fn look(half_extent_m: f64, cell_m: f64, legend: Vec<LegendEntry>) -> Look {
    Look {
        half_extent_m: half_extent_m as f32,
        cell_m: cell_m as f32,
        height_m: HEIGHT_M,
        heights: colours::HEIGHTS,
        side: SIDE,
        scale: 1.0,
        legend,
    }
}

pub(super) fn entry(sign: Sign, text: &str) -> LegendEntry {
    LegendEntry { sign, text: text.to_string() }
}

/// The legend of a ramp of heights.
pub(super) fn heights(
    look_heights: &'static [colours::Colour],
    most_m: f32,
    text: &str,
) -> LegendEntry {
    entry(Sign::Ramp(look_heights, ["0".into(), format!("≥ {most_m} m")]), text)
}

/// The legend of the heights of returns.
pub(super) fn return_heights() -> LegendEntry {
    heights(colours::HEIGHTS, HEIGHT_M, "height of returns")
}

/// The legend of the arrows' colours, and an arrow of 10 m/s.
pub(super) fn speeds(of: &str) -> [LegendEntry; 2] {
    let ends = ["0".into(), format!("≥ {FAST_MPS}")];
    [
        entry(Sign::Ramp(colours::SPEEDS, ends), &format!("m/s {of}")),
        entry(Sign::Arrow(arrow([10.0, 0.0], WIDE)), &format!("10 m/s ({ARROW_S} s of motion)")),
    ]
}

/// The arrow of a velocity, m/s along the picture's axes.
pub(super) fn arrow(velocity: [f32; 2], width: f32) -> Arrow {
    let colour = colours::ramp(colours::SPEEDS, speed(velocity) / FAST_MPS);
    Arrow { vector: velocity.map(|v| v * ARROW_S), colour, width }
}

/// The magnitude of a velocity, m/s. Not computed by `hypot`, which differs between platforms.
pub(super) fn speed([x, y]: [f32; 2]) -> f32 {
    (x * x + y * y).sqrt()
}

/// Rotates a direction from the world's to the vehicle's axes.
pub(super) fn along_vehicle(world_from_vehicle: &Pose, [x, y]: [f64; 2]) -> [f32; 2] {
    let along = world_from_vehicle.rotation.conjugate() * DVec3::new(x, y, 0.0);
    [along.x as f32, along.y as f32]
}

pub(super) fn places(sweep: &SweepData) -> Vec<[f32; 3]> {
    sweep.points.iter().map(|p| p.position).collect()
}
