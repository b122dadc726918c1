//! A sweep from above with labels, columns, errors and motion: what a number cannot show.

mod legend;
mod view;

use super::raster;
use super::svg::{Area, Svg};
use crate::labels::Kind;
use raywake_core::pose::Pose;
use raywake_io::Error;
use view::View;

/// Width and height of a panel in units and pixels per unit: where panels stand side by side on a
/// page, they are smaller beside the same text.
fn side_and_scale(panels: usize) -> (f64, f32) {
    if panels > 1 { (460.0, 1.8) } else { (700.0, 1.5) }
}

/// Around everything, units.
const MARGIN: f64 = 14.0;

/// Between panels, units.
const GAP: f64 = 28.0;

/// Above a panel, for its title; units.
const TITLE: f64 = 30.0;

/// Below the panels, for two rows of legend; units.
const LEGEND: f64 = 66.0;

/// Height of text, units.
const SIZE: f64 = 13.0;

/// Colours of arrows.
const TRUTH: &str = "#2a9df4";
const ESTIMATE: &str = "#b00020";

/// One view; everything lies in the vehicle frame (x forward, y left, z up, metres), drawn with the
/// vehicle in the middle and forward up.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Returns.
    pub points: Vec<[f32; 3]>,
    /// Labelled boxes.
    pub outlines: Vec<Outline>,
    /// Columns with what is known of their motion.
    pub columns: Vec<Column>,
}

/// A labelled box.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    /// `vehicle_from_box`, the box's frame in its centre, x forward.
    pub pose: Pose,
    /// Length and width, m.
    pub size: [f64; 2],
    /// Gives the colour.
    pub kind: Kind,
}

/// A column of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its centre, m.
    pub at: [f64; 2],
    /// Gives the colour; grey where nothing is known.
    pub error: Option<f64>,
    /// Arrow of the true motion, m on the picture.
    pub truth: Option<[f64; 2]>,
    /// Arrow of the estimated motion, m on the picture.
    pub estimate: Option<[f64; 2]>,
}

/// What all panels of a picture share.
#[derive(Clone, Debug)]
pub struct Look {
    /// How far a panel reaches to every side, m.
    pub half_extent_m: f64,
    /// Width of a column, m.
    pub cell_m: f64,
    /// Name and unit of the error, as in "error, m".
    pub error: String,
    /// Error from which on columns have the colour of the worst.
    pub worst: f64,
    /// What the length of an arrow means, as in "way in 0.5 s".
    pub arrows: String,
}

/// Draws panels side by side above one legend: returns by height, circles of range, boxes by class,
/// columns by error from green to dark red, the motion of columns as arrows, one for each block
/// of 2 x 2 columns. What lies outside or is not finite is left out.
///
/// Returns a PNG file. Fails where the picture is larger than memory, or `half_extent_m` is not
/// positive.
pub fn birds_eye(panels: &[Panel], look: &Look) -> Result<Vec<u8>, Error> {
    if !(look.half_extent_m > 0.0 && look.half_extent_m.is_finite()) {
        let what = format!("bird's-eye view: reaches {} m", look.half_extent_m);
        return Err(Error::Usage(what));
    }
    let (side, scale) = side_and_scale(panels.len());
    let n = panels.len().max(1) as f64;
    let size = [side * n + GAP * (n - 1.0), TITLE + side + LEGEND];
    let views: Vec<View> = (0..panels.len()).map(|i| View::new(i, side, look)).collect();
    let mut under = Svg::new(size[0], size[1], MARGIN);
    let mut over = Svg::new(size[0], size[1], MARGIN);
    let mut sheet = raster::sheet(under.size(), scale)?;
    for (view, panel) in views.iter().zip(panels) {
        view.draw_under(&mut under, panel);
        view.draw_over(&mut over, panel, look);
    }
    legend::draw(&mut over, panels, look, TITLE + side + 24.0);
    raster::draw(&under.finish("circles"), scale, &mut sheet)?;
    for (view, panel) in views.iter().zip(panels) {
        view.draw_points(&mut sheet, scale, &panel.points);
    }
    raster::draw(&over.finish("labels and flow"), scale, &mut sheet)?;
    raster::encode(&sheet)
}

/// A rectangle of one colour.
pub(super) fn rect(a: Area, colour: &str) -> String {
    let Area { left, top, width, height } = a;
    format!(
        "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" \
         fill=\"{colour}\"/>"
    )
}

/// Path data through these places.
fn path(places: &[[f64; 2]]) -> String {
    let step = |(i, [x, y]): (usize, &[f64; 2])| {
        format!("{}{x:.2} {y:.2}", if i == 0 { "M" } else { "L" })
    };
    places.iter().enumerate().map(step).collect()
}
