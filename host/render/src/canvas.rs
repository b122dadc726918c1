//! Shapes and text drawn on a picture.

use crate::colours::Colour;
use crate::text;
use tiny_skia::{
    Color, FillRule, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Rect, Stroke, StrokeDash,
    Transform,
};

/// Why a picture cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// No pixels, or too many.
    #[error("a picture cannot have {} x {} pixels", .0[0], .0[1])]
    Size([f32; 2]),
    /// An extent that a picture cannot have, m.
    #[error("a picture cannot cover {0} m")]
    Extent(f32),
}

/// Maximum width and height of a picture, pixels.
const PIXELS_MAX: f32 = 16_384.0;

/// Shapes further than this from a picture's corner, units, are not drawn: the rasteriser works in
/// fixed point.
const FAR: f32 = 30_000.0;

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Its colour.
    pub colour: Colour,
    /// Its width, units.
    pub width: f32,
    /// Lengths of a dash and of the gap after it, units; both 0 for a solid line.
    pub dashes: [f32; 2],
}

impl Pen {
    /// A solid line.
    pub const fn new(colour: Colour, width: f32) -> Pen {
        Pen { colour, width, dashes: [0.0; 2] }
    }
}

/// Which point of a text its position refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// The left end.
    Start,
    /// The middle.
    Middle,
    /// The right end.
    End,
}

/// A picture being drawn. Positions and sizes are in units, x to the right, y down from the upper
/// left corner; anything not finite, or far outside, is not drawn.
pub struct Canvas {
    pixmap: Pixmap,
    scale: f32,
}

impl Canvas {
    /// Creates a picture of this width and height (units) in one colour, with `scale` pixels per
    /// unit.
    ///
    /// Fails if it would have no pixels, or more than 16,384 in a row or column.
    pub fn new(size: [f32; 2], scale: f32, background: Colour) -> Result<Canvas, PictureError> {
        let pixels = size.map(|v| (v * scale).ceil());
        let error = PictureError::Size(pixels);
        if !pixels.iter().all(|v| (1.0..=PIXELS_MAX).contains(v)) {
            return Err(error);
        }
        let [width, height] = pixels.map(|v| v as u32);
        let mut pixmap = Pixmap::new(width, height).ok_or(error)?;
        pixmap.fill(colour_of(background, 1.0));
        Ok(Canvas { pixmap, scale })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.pixmap.width(), self.pixmap.height()]
    }

    /// Rows from the top of red, green, blue and opacity, 0 to 255.
    pub fn rgba(&self) -> &[u8] {
        self.pixmap.data()
    }

    /// Returns the picture as a PNG file; it has no transparent pixels.
    pub fn png(&self) -> Vec<u8> {
        let rgb = self.rgb();
        let mut file = Vec::new();
        let [width, height] = self.size();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_filter(png::Filter::NoFilter);
        let write = |mut encoder: png::Writer<_>| encoder.write_image_data(&rgb);
        encoder.write_header().and_then(write).expect("writing to memory does not fail");
        file
    }

    /// Rows from the top of red, green and blue.
    pub(crate) fn rgb(&self) -> Vec<u8> {
        self.rgba().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// Draws a filled polygon.
    pub fn polygon(&mut self, corners: &[[f32; 2]], colour: Colour, opacity: f32) {
        if let Some(path) = path(corners, true) {
            self.fill(&path, colour, opacity);
        }
    }

    /// Draws a line through some positions, closed or open.
    pub fn line(&mut self, places: &[[f32; 2]], closed: bool, pen: Pen) {
        if let Some(path) = path(places, closed) {
            self.stroke(&path, pen);
        }
    }

    /// Draws a circle.
    pub fn circle(&mut self, [x, y]: [f32; 2], radius: f32, pen: Pen) {
        if near([x, y])
            && radius < FAR
            && let Some(path) = PathBuilder::from_circle(x, y, radius)
        {
            self.stroke(&path, pen);
        }
    }

    /// Draws a disc.
    pub fn disc(&mut self, [x, y]: [f32; 2], radius: f32, colour: Colour, opacity: f32) {
        if near([x, y])
            && radius < FAR
            && let Some(path) = PathBuilder::from_circle(x, y, radius)
        {
            self.fill(&path, colour, opacity);
        }
    }

    /// Draws a square of whole pixels, at least one, around a position: fast for large numbers.
    pub fn square(&mut self, at: [f32; 2], side: f32, colour: Colour, opacity: f32) {
        let [x, y] = at.map(|v| ((v - 0.5 * side) * self.scale).round());
        let side = (side * self.scale).round().max(1.0);
        if near(at)
            && let Some(rect) = Rect::from_xywh(x, y, side, side)
        {
            let paint = Paint { anti_alias: false, ..paint(colour, opacity) };
            self.pixmap.fill_rect(rect, &paint, Transform::identity(), None);
        }
    }

    /// Draws a rectangle from its upper left corner.
    pub fn rect(&mut self, [x, y]: [f32; 2], [w, h]: [f32; 2], colour: Colour, opacity: f32) {
        self.polygon(&[[x, y], [x + w, y], [x + w, y + h], [x, y + h]], colour, opacity);
    }

    /// Fills the area between two polygons, one inside the other.
    pub fn frame(&mut self, outer: &[[f32; 2]], inner: &[[f32; 2]], colour: Colour, opacity: f32) {
        let mut both = PathBuilder::new();
        for polygon in [outer, inner] {
            let Some(path) = path(polygon, true) else { return };
            both.push_path(&path);
        }
        if let Some(path) = both.finish() {
            let (paint, scale) = (paint(colour, opacity), self.transform());
            self.pixmap.fill_path(&path, &paint, FillRule::EvenOdd, scale, None);
        }
    }

    /// Draws a line of text on the baseline through `at`, `size` units high.
    pub fn text(&mut self, at: [f32; 2], text: &str, size: f32, align: Align, colour: Colour) {
        let width = text::width(text, size);
        let left = match align {
            Align::Start => at[0],
            Align::Middle => at[0] - 0.5 * width,
            Align::End => at[0] - width,
        };
        if near(at)
            && let Some(path) = text::outlines(text, [left, at[1]], size)
        {
            self.fill(&path, colour, 1.0);
        }
    }

    /// Draws another picture of the same scale onto this one, its upper left corner at `at`.
    pub fn place(&mut self, other: &Canvas, at: [f32; 2]) {
        let [x, y] = at.map(|v| (v * self.scale).round() as i32);
        let (paint, identity) = (PixmapPaint::default(), Transform::identity());
        self.pixmap.draw_pixmap(x, y, other.pixmap.as_ref(), &paint, identity, None);
    }

    fn fill(&mut self, path: &Path, colour: Colour, opacity: f32) {
        let (paint, scale) = (paint(colour, opacity), self.transform());
        self.pixmap.fill_path(path, &paint, FillRule::Winding, scale, None);
    }

    fn stroke(&mut self, path: &Path, pen: Pen) {
        let dash = pen.dashes[0] > 0.0 && pen.dashes[1] > 0.0;
        let dash = dash.then(|| StrokeDash::new(pen.dashes.to_vec(), 0.0)).flatten();
        let stroke = Stroke { width: pen.width, dash, ..Stroke::default() };
        let (paint, scale) = (paint(pen.colour, 1.0), self.transform());
        self.pixmap.stroke_path(path, &paint, &stroke, scale, None);
    }

    fn transform(&self) -> Transform {
        Transform::from_scale(self.scale, self.scale)
    }
}

/// Whether a position (units) can be drawn.
fn near(at: [f32; 2]) -> bool {
    at.iter().all(|v| v.abs() < FAR)
}

fn path(places: &[[f32; 2]], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (i, &[x, y]) in places.iter().enumerate() {
        if !near([x, y]) {
            return None;
        }
        if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    if closed {
        path.close();
    }
    path.finish()
}

fn colour_of([r, g, b]: Colour, opacity: f32) -> Color {
    Color::from_rgba8(r, g, b, (opacity.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

fn paint(colour: Colour, opacity: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour_of(colour, opacity));
    paint
}
