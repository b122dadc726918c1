//! A sweep from above with labels, columns, errors and motion: what a number cannot show.

use crate::labels::Kind;
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::Error;
use raywake_render::{self as render, Arrow, Cell, Colour, LegendEntry, Sign, colours};
use std::collections::BTreeSet;

/// Height above the ground of the darkest returns, m.
const HEIGHT_M: f32 = 2.5;
/// Colours of arrows and of columns whose error is unknown.
const TRUTH: Colour = [42, 157, 244];
const ESTIMATE: Colour = [176, 0, 32];
const UNKNOWN: Colour = [154, 164, 178];
/// From no error to the worst: green, yellow, orange, dark red; the ends differ in lightness.
const ERRORS: &[Colour] = &[[0, 158, 115], [240, 214, 60], [226, 106, 20], [140, 16, 40]];

/// One view; all coordinates are in the vehicle frame (x forward, y left, z up, metres), drawn with
/// the vehicle in the centre and forward up.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Shown above the view.
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
    /// `vehicle_from_box`; the box's frame is centred in it, x forward.
    pub pose: Pose,
    /// Length and width, m.
    pub size: [f64; 2],
    /// Determines the colour.
    pub kind: Kind,
}

/// A column of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its centre, m.
    pub at: [f64; 2],
    /// Determines the colour; grey if unknown.
    pub error: Option<f64>,
    /// Arrow of the true motion, m in the picture.
    pub truth: Option<[f64; 2]>,
    /// Arrow of the estimated motion, m in the picture.
    pub estimate: Option<[f64; 2]>,
}

/// Settings shared by all panels of a picture.
#[derive(Clone, Debug)]
pub struct Look {
    /// How far a panel reaches in every direction, m.
    pub half_extent_m: f64,
    /// Width of a column, m.
    pub cell_m: f64,
    /// Name and unit of the error, as in "error, m".
    pub error: String,
    /// Error from which on columns get the colour of the worst.
    pub worst: f64,
    /// Meaning of an arrow's length, as in "way in 0.5 s".
    pub arrows: String,
}

/// Draws panels side by side above one legend: returns by height, range rings, boxes by class,
/// columns by error, and the motion of columns as arrows, one for each block of 2 x 2 columns.
/// Whatever lies outside or is not finite is left out.
///
/// Returns a PNG file. Fails if `half_extent_m` or `cell_m` is not positive.
pub fn birds_eye(panels: &[Panel], look: &Look) -> Result<Vec<u8>, Error> {
    // Panels side by side appear smaller on a page, next to text of the same size.
    let (side, scale) = if panels.len() > 1 { (460.0, 1.8) } else { (700.0, 1.5) };
    let drawn: Vec<render::Panel> = panels.iter().map(|panel| look.panel(panel, side)).collect();
    let shared = render::Look {
        half_extent_m: look.half_extent_m as f32,
        cell_m: look.cell_m as f32,
        height_m: HEIGHT_M,
        heights: colours::HEIGHTS,
        side: side as f32,
        scale,
        legend: look.legend(panels, side),
    };
    let canvas = render::birds_eye(&drawn, &shared);
    Ok(canvas.map_err(|e| Error::Usage(format!("bird's-eye view: {e}")))?.png())
}

impl Look {
    fn panel(&self, panel: &Panel, side: f64) -> render::Panel {
        render::Panel {
            title: panel.title.clone(),
            points: panel.points.clone(),
            outlines: panel.outlines.iter().map(outline).collect(),
            cells: panel.columns.iter().map(|column| self.cell(column, side)).collect(),
            vehicle: true,
            ..render::Panel::default()
        }
    }

    fn cell(&self, column: &Column, side: f64) -> Cell {
        let error = column.error.filter(|e| e.is_finite());
        let colour = error.map_or(UNKNOWN, |e| colours::ramp(ERRORS, (e / self.worst) as f32));
        let [truth, estimate] = self.arrows(side);
        let arrow = |like: Arrow, vector: Option<[f64; 2]>| {
            vector.map(|way| Arrow { vector: way.map(|v| v as f32), ..like })
        };
        // The truth goes below, so that a matching estimate lies on top of it.
        let arrows = [arrow(truth, column.truth), arrow(estimate, column.estimate)];
        Cell { at: column.at.map(|v| v as f32), colour, arrows }
    }

    /// The arrows of truth and estimate, thinner if columns are small.
    fn arrows(&self, side: f64) -> [Arrow; 2] {
        let width = (0.11 * self.cell_m * side / self.half_extent_m).clamp(0.8, 1.6) as f32;
        [(TRUTH, 2.4 * width), (ESTIMATE, width)].map(|(colour, width)| Arrow {
            vector: [0.0; 2],
            colour,
            width,
        })
    }

    /// Entries only for what is drawn.
    fn legend(&self, panels: &[Panel], side: f64) -> Vec<LegendEntry> {
        let any = |of: fn(&Column) -> bool| panels.iter().any(|p| p.columns.iter().any(of));
        let [truth, estimate] = self.arrows(side);
        let error = Sign::Ramp(ERRORS, ["0".into(), format!("≥ {}", self.worst)]);
        let signs = [
            (error, self.error.clone(), any(|c| c.error.is_some())),
            (Sign::Arrow(truth), format!("true, {}", self.arrows), any(|c| c.truth.is_some())),
            (
                Sign::Arrow(estimate),
                format!("estimated, {}", self.arrows),
                any(|c| c.estimate.is_some()),
            ),
        ];
        let signs =
            signs.into_iter().filter(|s| s.2).map(|(sign, text, _)| LegendEntry { sign, text });
        let kinds: BTreeSet<Kind> =
            panels.iter().flat_map(|p| &p.outlines).map(|o| o.kind).collect();
        let kinds = kinds.into_iter().map(|kind| {
            let (name, colour) = class(kind);
            LegendEntry { sign: Sign::Outline(colour), text: name.into() }
        });
        signs.chain(kinds).collect()
    }
}

fn outline(outline: &Outline) -> render::Outline {
    let forward = outline.pose.rotation * DVec3::X;
    let centre = outline.pose.translation;
    render::Outline {
        at: [centre.x, centre.y].map(|v| v as f32),
        forward: [forward.x, forward.y].map(|v| v as f32),
        size: outline.size.map(|v| v as f32),
        colour: class(outline.kind).1,
        label: String::new(),
        arrow: None,
    }
}

fn class(kind: Kind) -> (&'static str, Colour) {
    match kind {
        Kind::Car => ("car", [0, 114, 178]),
        Kind::Van => ("van", [63, 155, 208]),
        Kind::Truck => ("truck", [122, 106, 83]),
        Kind::Bus => ("bus", [163, 127, 54]),
        Kind::Tram => ("tram", [75, 79, 88]),
        Kind::Motorcycle => ("motorcycle", [181, 96, 154]),
        Kind::Cyclist => ("cyclist", [213, 94, 0]),
        Kind::Pedestrian => ("pedestrian", [163, 48, 138]),
        Kind::Other => ("other", [135, 146, 162]),
    }
}
