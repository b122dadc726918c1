//! Bird's-eye pictures of a sweep and its flow.

use std::path::Path;

use raywake_core::output::{ColumnFlow, Origin};
use raywake_core::sweep::Point;

use super::canvas::{Canvas, Colour, Pixel};
use crate::Error;

/// Width and height of a picture, pixels.
pub const SIZE: usize = 900;

/// An arrow is as long as the way in this time, s.
const ARROW_S: f32 = 0.5;

/// Slower columns are dots, m/s.
const SLOW_MPS: f32 = 0.5;

/// Observations below which a tracklet is not drawn, as in the author's viewer: most false matches
/// end before.
const AGE_MIN: u32 = 3;

/// Heights above ground from the palest to the darkest returns, m.
const HEIGHT_SPAN_M: f32 = 2.5;

const BACKGROUND: Colour = [252.0, 252.0, 253.0];
const GRID: Colour = [205.0, 210.0, 218.0];
const INK: Colour = [40.0, 44.0, 52.0];
const SHAFT: Colour = [240.0, 92.0, 84.0];
const HEAD: Colour = [190.0, 16.0, 28.0];
const VEHICLE: Colour = [58.0, 64.0, 76.0];
const WINDSCREEN: Colour = [190.0, 200.0, 214.0];

/// Colours of returns from the ground up.
const HEIGHTS: [Colour; 4] =
    [[196.0, 214.0, 232.0], [120.0, 168.0, 214.0], [44.0, 106.0, 178.0], [10.0, 38.0, 92.0]];

/// Which velocity is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Velocity {
    /// Over ground; the heading of the vehicle in the world turns it onto the picture.
    World {
        /// [`raywake_core::pose::Pose::yaw_rad`] of the sweep's pose.
        vehicle_yaw_rad: f64,
    },
    /// Relative to the moving vehicle.
    Ego,
}

/// Draws returns coloured by height and the flow of matched foreground columns, from the third
/// observation on, as arrows as long as the way in half a second, dots below 0.5 m/s; the vehicle in the middle, forward up; circles
/// every 20 m and a scale of 10 m. Reaches `half_extent_m` to every side.
///
/// Returns [`SIZE`] rows of [`SIZE`] pixels of red, green, blue.
pub fn birdseye(
    points: &[Point],
    columns: &[ColumnFlow],
    half_extent_m: f32,
    velocity: Velocity,
) -> Vec<u8> {
    let view = View { pixels_per_m: 0.5 * SIZE as f32 / half_extent_m.max(1.0) };
    let mut canvas = Canvas::new(SIZE, BACKGROUND);
    draw_circles(&mut canvas, &view);
    draw_points(&mut canvas, &view, points);
    draw_vehicle(&mut canvas, &view);
    draw_flow(&mut canvas, &view, columns, velocity);
    draw_scale(&mut canvas, &view);
    canvas.bytes()
}

/// Writes a picture of [`birdseye`]. Fails where the file cannot be written, and with
/// [`Error::Unsupported`] without the feature `png`.
#[cfg(feature = "png")]
pub fn write_png(path: &Path, rgb: &[u8]) -> Result<(), Error> {
    use std::io;
    super::atomic::write(path, |out| {
        let mut encoder = png::Encoder::new(out, SIZE as u32, SIZE as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let reason = |e| match e {
            png::EncodingError::IoError(e) => e,
            other => io::Error::other(other),
        };
        let mut writer = encoder.write_header().map_err(reason)?;
        writer.write_image_data(rgb).map_err(reason)?;
        writer.finish().map_err(reason)
    })
}

/// Fails: this build has no pictures.
#[cfg(not(feature = "png"))]
pub fn write_png(path: &Path, _: &[u8]) -> Result<(), Error> {
    let what = "this build lacks the feature `png` to write pictures";
    Err(Error::Unsupported(format!("{}: {what}", path.display())))
}

/// Where metres of the vehicle frame lie on the picture.
struct View {
    pixels_per_m: f32,
}

impl View {
    fn pixel(&self, [x, y]: [f32; 2]) -> Pixel {
        let middle = 0.5 * SIZE as f32;
        [middle - y * self.pixels_per_m, middle - x * self.pixels_per_m]
    }

    /// Whether something this far (pixels) around a place can be seen.
    fn sees(&self, p: Pixel, margin: f32) -> bool {
        p.iter().all(|v| (-margin..SIZE as f32 + margin).contains(v))
    }
}

fn draw_circles(canvas: &mut Canvas, view: &View) {
    let corner_m = 0.5 * SIZE as f32 / view.pixels_per_m * core::f32::consts::SQRT_2;
    let circles = (corner_m / 20.0) as usize;
    // More than a few would hide what they are to measure.
    for i in 1..=circles.min(10) {
        let radius = 20.0 * i as f32 * view.pixels_per_m;
        canvas.ring(view.pixel([0.0, 0.0]), radius, 1.0, GRID, 0.7);
    }
}

fn draw_points(canvas: &mut Canvas, view: &View, points: &[Point]) {
    let seen = |p: &Point| {
        let pixel = view.pixel([p.position[0], p.position[1]]);
        (p.position[2].is_finite() && view.sees(pixel, 0.0)).then_some((p.position[2], pixel))
    };
    let mut seen: Vec<(f32, Pixel)> = points.iter().filter_map(seen).collect();
    // From the ground up, so that what stands there stays visible.
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(ground, _)) = seen.get(seen.len() / 10) else { return };
    for (z, pixel) in seen {
        let height = ((z - ground) / HEIGHT_SPAN_M).clamp(0.0, 1.0);
        canvas.disc(pixel, 0.75, height_colour(height), 0.45 + 0.4 * height);
    }
}

/// Between the colours of [`HEIGHTS`], `height` in 0..=1.
fn height_colour(height: f32) -> Colour {
    let place = height * (HEIGHTS.len() - 1) as f32;
    let i = (place as usize).min(HEIGHTS.len() - 2);
    let t = place - i as f32;
    [0, 1, 2].map(|c| HEIGHTS[i][c] + (HEIGHTS[i + 1][c] - HEIGHTS[i][c]) * t)
}

fn draw_flow(canvas: &mut Canvas, view: &View, columns: &[ColumnFlow], velocity: Velocity) {
    let ends = |column: &ColumnFlow| {
        let v = along_vehicle(column, velocity);
        let [x, y] = column.position_vehicle_m;
        let from = view.pixel([x, y]);
        let to = view.pixel([x + v[0] * ARROW_S, y + v[1] * ARROW_S]);
        let drawn = to.iter().all(|v| v.is_finite()) && view.sees(from, 0.0);
        drawn.then_some((from, to, v[0].hypot(v[1]) < SLOW_MPS))
    };
    let old = |c: &&ColumnFlow| c.origin == Origin::Matched && c.age >= AGE_MIN;
    let matched = columns.iter().filter(old);
    let arrows: Vec<_> = matched.filter_map(ends).collect();
    // All heads after all shafts: columns stand close, and shafts would cover their neighbours'
    // heads.
    for &(from, to, _) in arrows.iter().filter(|a| !a.2) {
        canvas.line(from, to, 1.2, SHAFT, 0.8);
    }
    for &(from, to, slow) in &arrows {
        if slow {
            canvas.disc(from, 1.5, HEAD, 0.7);
        } else {
            canvas.head(from, to, 6.0, HEAD, 1.0);
        }
    }
}

/// The velocity to draw, along the vehicle's axes, m/s.
fn along_vehicle(column: &ColumnFlow, velocity: Velocity) -> [f32; 2] {
    match velocity {
        Velocity::Ego => column.velocity_ego_mps,
        Velocity::World { vehicle_yaw_rad } => {
            let (s, c) = (vehicle_yaw_rad.sin() as f32, vehicle_yaw_rad.cos() as f32);
            let [x, y] = column.velocity_world_mps;
            [c * x + s * y, c * y - s * x]
        }
    }
}

/// A car around the origin with its windscreen to the front.
fn draw_vehicle(canvas: &mut Canvas, view: &View) {
    let corners = |(back, front, half_back, half_front): (f32, f32, f32, f32)| {
        [[front, half_front], [front, -half_front], [back, -half_back], [back, half_back]]
            .map(|p| view.pixel(p))
    };
    canvas.polygon(&corners((-2.0, 2.0, 0.9, 0.9)), VEHICLE, 1.0);
    canvas.polygon(&corners((1.9, 2.6, 0.9, 0.65)), VEHICLE, 1.0);
    canvas.polygon(&corners((0.5, 1.1, 0.6, 0.75)), WINDSCREEN, 1.0);
}

fn draw_scale(canvas: &mut Canvas, view: &View) {
    let size = SIZE as f32;
    let (right, y) = (size - 30.0, size - 30.0);
    let left = right - 10.0 * view.pixels_per_m;
    let (low, high) = ([left - 12.0, y - 34.0], [right + 12.0, y + 14.0]);
    canvas.polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]], BACKGROUND, 0.85);
    canvas.line([left, y], [right, y], 2.0, INK, 1.0);
    for x in [left, right] {
        canvas.line([x, y - 5.0], [x, y + 5.0], 2.0, INK, 1.0);
    }
    let text = "10 m";
    let width = 2.0 * (6.0 * text.len() as f32 - 1.0);
    canvas.text([0.5 * (left + right - width), y - 24.0], text, 2.0, INK);
}
