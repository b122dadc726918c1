//! Text as outlines of an embedded font.

use epaint_default_fonts::UBUNTU_LIGHT;
use std::sync::OnceLock;
use tiny_skia::{Path, PathBuilder};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Returns the width of a line of text, in the unit of `size`, the height of the font.
pub fn width(text: &str, size: f32) -> f32 {
    glyphs(text).map(advance).sum::<f32>() * unit(size)
}

/// Returns the outlines of a line of text that starts at `[x, y]` on the baseline; `None` if it has
/// none.
pub(crate) fn outlines(text: &str, [x, y]: [f32; 2], size: f32) -> Option<Path> {
    let mut pen = GlyphPath { path: PathBuilder::new(), x, y, unit: unit(size) };
    for glyph in glyphs(text) {
        face().outline_glyph(glyph, &mut pen);
        pen.x += advance(glyph) * pen.unit;
    }
    pen.path.finish()
}

fn face() -> &'static Face<'static> {
    static FACE: OnceLock<Face<'static>> = OnceLock::new();
    FACE.get_or_init(|| Face::parse(UBUNTU_LIGHT, 0).expect("the embedded font is whole"))
}

fn unit(size: f32) -> f32 {
    size / f32::from(face().units_per_em())
}

/// Characters missing from the font become its empty box.
fn glyphs(text: &str) -> impl Iterator<Item = GlyphId> {
    text.chars().map(|c| face().glyph_index(c).unwrap_or_default())
}

fn advance(glyph: GlyphId) -> f32 {
    f32::from(face().glyph_hor_advance(glyph).unwrap_or_default())
}

/// Transforms glyphs, given in font units with y up, to a picture with y down.
struct GlyphPath {
    path: PathBuilder,
    x: f32,
    y: f32,
    unit: f32,
}

impl GlyphPath {
    fn at(&self, x: f32, y: f32) -> [f32; 2] {
        [self.x + x * self.unit, self.y - y * self.unit]
    }
}

impl OutlineBuilder for GlyphPath {
    fn move_to(&mut self, x: f32, y: f32) {
        let [x, y] = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let [x, y] = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ([x1, y1], [x, y]) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ([x1, y1], [x2, y2], [x, y]) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
