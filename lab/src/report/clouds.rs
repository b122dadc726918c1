//! Clouds from above and from the side, coloured by time, side by side.

use super::palette::{self, INK, MUTED};
use super::raster;
use super::svg::{Anchor, Area, Svg};
use raywake_io::Error;
use resvg::tiny_skia::{Paint, Pixmap, Rect, Transform};

/// Width of a panel, units.
const WIDE: f64 = 340.0;
/// Between panels, and around everything, units.
const GAP: f64 = 14.0;
/// Above the panels, for their titles; below, for the scale; units.
const TITLE: f64 = 26.0;
const FOOT: f64 = 30.0;
/// Pixels per unit.
const SCALE: f32 = 2.0;
/// Side of a point, pixels.
const POINT: f32 = 2.0;
/// Free space around the object, m.
const MARGIN_M: f64 = 0.3;

/// A cloud with a title.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Above it.
    pub title: String,
    /// x to the right, y up and z towards whoever looks from above, m.
    pub points: Vec<[f32; 3]>,
    /// When each was seen: 0 at the beginning, 1 at the end.
    pub times: Vec<f32>,
}

/// Draws clouds side by side at one scale, seen from above and beneath it from the right, from blue
/// (first) to yellow (last). The scale is chosen to show `reach` m (length, width, height) about the
/// origin; what lies beyond is left out.
///
/// Returns a PNG file. Fails where the picture is larger than memory.
pub fn clouds(clouds: &[Cloud], reach: [f64; 3]) -> Result<Vec<u8>, Error> {
    let [length, width, height] = reach.map(|v| v + 2.0 * MARGIN_M);
    let per_m = WIDE / length;
    let (above, beside) = (width * per_m, height * per_m);
    let n = clouds.len().max(1) as f64;
    let size = [WIDE * n + GAP * (n - 1.0), TITLE + above + GAP + beside + FOOT];
    let mut svg = Svg::new(size[0], size[1], GAP);
    let mut panels = Vec::new();
    for (i, cloud) in clouds.iter().enumerate() {
        let left = i as f64 * (WIDE + GAP);
        svg.text([left, 16.0], &cloud.title, 15.0, Anchor::Start, INK);
        let top = Area { left, top: TITLE, width: WIDE, height: above };
        let side = Area { top: TITLE + above + GAP, height: beside, ..top };
        for area in [top, side] {
            svg.raw(&super::birds_eye::rect(area, "#f8f9fb"));
        }
        panels.push([top, side]);
    }
    let foot = size[1] - 8.0;
    svg.raw(&super::birds_eye::rect(
        Area { left: 0.0, top: foot - 4.0, width: per_m, height: 2.0 },
        "#667085",
    ));
    let legend = "1 m; from above, and from the right; blue first, yellow last";
    svg.text([per_m + 8.0, foot], legend, 13.0, Anchor::Start, MUTED);
    let mut sheet = raster::sheet(svg.size(), SCALE)?;
    raster::draw(&svg.finish("clouds"), SCALE, &mut sheet)?;
    for (cloud, [top, side]) in clouds.iter().zip(panels) {
        for (p, time) in cloud.points.iter().zip(&cloud.times) {
            let [x, y, z] = p.map(f64::from);
            let colour = palette::time(f64::from(*time));
            dot(&mut sheet, top, [x, y].map(|v| v * per_m), colour);
            dot(&mut sheet, side, [x, z].map(|v| v * per_m), colour);
        }
    }
    raster::encode(&sheet)
}

/// A point so far right of and above the middle of an area, units, if it lies within it.
fn dot(sheet: &mut Pixmap, area: Area, [x, y]: [f64; 2], [r, g, b]: [u8; 3]) {
    if !(x.abs() < 0.5 * area.width && y.abs() < 0.5 * area.height) {
        return;
    }
    let at = [area.left + 0.5 * area.width + x, area.top + 0.5 * area.height - y];
    let [left, top] = at.map(|v| ((v + GAP) as f32 * SCALE - 0.5 * POINT).round());
    let mut paint = Paint { anti_alias: false, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, 200);
    if let Some(square) = Rect::from_xywh(left, top, POINT, POINT) {
        sheet.fill_rect(square, &paint, Transform::identity(), None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_the_colour_of_their_time_and_stay_in_their_panels() {
        let cloud = |points: &[[f32; 3]], times: &[f32]| Cloud {
            title: String::new(),
            points: points.to_vec(),
            times: times.to_vec(),
        };
        let two =
            [cloud(&[[0.5, 0.2, 0.1]], &[0.0]), cloud(&[[0.0; 3], [9.0, 0.0, 0.0]], &[1.0, 0.0])];
        let sheet = Pixmap::decode_png(&clouds(&two, [4.0, 2.0, 1.5]).unwrap()).unwrap();
        let half = sheet.width() as usize / 2;
        let count = |right: bool, like: fn([u8; 3]) -> bool| {
            let pixels = sheet.pixels().iter().enumerate();
            let side = pixels.filter(|(n, _)| (n % (2 * half) >= half) == right);
            side.filter(|(_, p)| like([p.red(), p.green(), p.blue()])).count()
        };
        // A square of four pixels from above, another from the right.
        let blue = |[r, g, b]: [u8; 3]| b > 140 && r < 120 && g < 120;
        let yellow = |[r, _, b]: [u8; 3]| r > 200 && b < 120;
        assert_eq!((count(false, blue), count(true, yellow)), (8, 8));
        assert_eq!(
            (count(false, yellow), count(true, blue)),
            (0, 0),
            "what lies beyond is left out"
        );
        assert!(clouds(&[], [4.0, 2.0, 1.5]).is_ok());
    }
}
