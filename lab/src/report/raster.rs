//! SVG to PNG with an embedded font: a machine without fonts draws the same picture.

use raywake_io::Error;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};
use std::sync::{Arc, OnceLock};

/// Renders an SVG of this size (units) on white as a PNG file, `scale` pixels per unit.
///
/// Fails if the document is not an SVG or the picture is empty or larger than memory.
pub(super) fn png(svg: &str, size: [f64; 2], scale: f32) -> Result<Vec<u8>, Error> {
    let options =
        Options { fontdb: fonts(), font_family: "sans-serif".into(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|e| failed(&e))?;
    let [width, height] = size.map(|v| (v * f64::from(scale)).ceil() as u32);
    let mut pixmap =
        Pixmap::new(width, height).ok_or_else(|| failed(&format!("{width} x {height} pixels")))?;
    pixmap.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|e| failed(&e))
}

fn failed(why: &dyn std::fmt::Display) -> Error {
    Error::Unsupported(format!("cannot draw a picture: {why}"))
}

fn fonts() -> Arc<Database> {
    static FONTS: OnceLock<Arc<Database>> = OnceLock::new();
    let load = || {
        let mut fonts = Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        let family = fonts.faces().next().and_then(|f| f.families.first().map(|f| f.0.clone()));
        fonts.set_sans_serif_family(family.unwrap_or_default());
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}
