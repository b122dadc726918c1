//! Clouds from above and from the side, coloured by time, side by side.

use raywake_io::Error;
use raywake_render::canvas::{Align, Canvas};
use raywake_render::{Colour, colours};

/// Width of a panel, units.
const WIDE: f64 = 340.0;
/// Space between panels and around everything, units.
const GAP: f64 = 14.0;
/// Space above the panels, for their titles; below, for the scale; units.
const TITLE: f64 = 26.0;
const FOOT: f64 = 30.0;
/// Pixels per unit.
const SCALE: f32 = 2.0;
/// Side of a point, units.
const POINT: f32 = 1.0;
/// Free space around the object, m.
const MARGIN_M: f64 = 0.3;
/// From first to last: blue through green to yellow, ever lighter.
const TIMES: &[Colour] = &[[53, 42, 135], [15, 118, 200], [55, 184, 157], [250, 220, 30]];

/// A cloud with a title.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Shown above it.
    pub title: String,
    /// x to the right, y up and z towards the viewer of the view from above, m.
    pub points: Vec<[f32; 3]>,
    /// When each was seen: 0 at the beginning, 1 at the end.
    pub times: Vec<f32>,
}

/// Draws clouds side by side at one scale, from above and, underneath, from the right, coloured
/// from blue (first) to yellow (last). The scale is chosen to show `reach` m (length, width,
/// height) around the origin; whatever lies beyond is left out.
///
/// Returns a PNG file. Fails if the picture has no pixels or too many.
pub fn clouds(clouds: &[Cloud], reach: [f64; 3]) -> Result<Vec<u8>, Error> {
    let [length, width, height] = reach.map(|v| v + 2.0 * MARGIN_M);
    let per_m = WIDE / length;
    let [above, beside] = [width, height].map(|v| v * per_m);
    let n = clouds.len().max(1) as f64;
    let page = [GAP + n * (WIDE + GAP), 3.0 * GAP + TITLE + above + beside + FOOT];
    let canvas = Canvas::new(page.map(|v| v as f32), SCALE, colours::PAPER);
    let mut canvas = canvas.map_err(|e| Error::Usage(format!("clouds: {e}")))?;
    for (i, cloud) in clouds.iter().enumerate() {
        let left = GAP + i as f64 * (WIDE + GAP);
        let title = [left, GAP + 16.0].map(|v| v as f32);
        canvas.text(title, &cloud.title, 15.0, Align::Start, colours::INK);
        let top = Area { corner: [left, GAP + TITLE], size: [WIDE, above] };
        let side = Area { corner: [left, 2.0 * GAP + TITLE + above], size: [WIDE, beside] };
        for area in [&top, &side] {
            let [corner, size] = [area.corner, area.size].map(|v| v.map(|v| v as f32));
            canvas.rect(corner, size, colours::GROUND, 1.0);
        }
        for (p, time) in cloud.points.iter().zip(&cloud.times) {
            let [x, y, z] = p.map(|v| f64::from(v) * per_m);
            let colour = colours::ramp(TIMES, *time);
            top.dot(&mut canvas, [x, y], colour);
            side.dot(&mut canvas, [x, z], colour);
        }
    }
    let [left, foot, metre] = [GAP, page[1] - GAP - 8.0, per_m].map(|v| v as f32);
    canvas.rect([left, foot - 4.0], [metre, 2.0], colours::MUTED, 1.0);
    let legend = "1 m; from above, and from the right; blue first, yellow last";
    canvas.text([left + metre + 8.0, foot], legend, 13.0, Align::Start, colours::MUTED);
    Ok(canvas.png())
}

/// A panel, units.
struct Area {
    corner: [f64; 2],
    size: [f64; 2],
}

impl Area {
    /// Draws a point this far right of and above the middle, units, if it lies within.
    fn dot(&self, canvas: &mut Canvas, [x, y]: [f64; 2], colour: Colour) {
        let ([left, top], [width, height]) = (self.corner, self.size);
        if x.abs() < 0.5 * width && y.abs() < 0.5 * height {
            let at = [left + 0.5 * width + x, top + 0.5 * height - y].map(|v| v as f32);
            canvas.square(at, POINT, colour, 0.8);
        }
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
        let png = clouds(&two, [4.0, 2.0, 1.5]).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let half = reader.next_frame(&mut rgb).unwrap().width as usize / 2;
        let count = |right: bool, like: fn([u8; 3]) -> bool| {
            let pixels = rgb.chunks_exact(3).enumerate();
            let side = pixels.filter(|(n, _)| (n % (2 * half) >= half) == right);
            side.filter(|(_, p)| like([p[0], p[1], p[2]])).count()
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
