//! The contents of a bird's-eye picture, as plain data.

use crate::canvas::Pen;
use crate::colours::Colour;

/// One view from above. Positions are in metres, x up and y to the left on the picture, with the
/// origin in the middle. Anything not finite, or outside, is not drawn.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Text above the panel, left.
    pub title: String,
    /// Text above the panel, right: frame and time, for example.
    pub note: String,
    /// Points, m, in pale colours by height.
    pub points: Vec<[f32; 3]>,
    /// Squares below everything else, [`Look::cell_m`] wide.
    pub tiles: Vec<Cell>,
    /// Columns of the grid with their motion.
    pub cells: Vec<Cell>,
    /// Boxes of objects.
    pub outlines: Vec<Outline>,
    /// Paths of objects.
    pub trails: Vec<Trail>,
    /// Corners of the window in which motion is estimated, if any; the area outside is shaded.
    pub window: Option<[[f32; 2]; 4]>,
    /// Whether to draw the own vehicle at the origin, its front up.
    pub vehicle: bool,
}

/// A square of one colour, optionally with motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Its centre, m.
    pub at: [f32; 2],
    /// Its colour.
    pub colour: Colour,
    /// Arrows from its centre, the second on top of the first. In every block of 2 x 2 cells, only
    /// the first one with arrows has them drawn: all of them would hide the cells.
    pub arrows: [Option<Arrow>; 2],
}

/// An arrow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrow {
    /// From its foot to its tip, m on the picture.
    pub vector: [f32; 2],
    /// Its colour.
    pub colour: Colour,
    /// Width of its shaft, units.
    pub width: f32,
}

/// A box on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Its centre, m.
    pub at: [f32; 2],
    /// Unit vector towards its front.
    pub forward: [f32; 2],
    /// Length and width, m.
    pub size: [f32; 2],
    /// Its colour.
    pub colour: Colour,
    /// Text below it.
    pub label: String,
    /// Arrow from its centre.
    pub arrow: Option<Arrow>,
}

/// The path of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Trail {
    /// Positions in time order, m.
    pub places: Vec<[f32; 2]>,
    /// Its colour.
    pub colour: Colour,
    /// Its width, units.
    pub width: f32,
}

/// What all panels of a picture share.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// How far a panel extends in each direction, m.
    pub half_extent_m: f32,
    /// Width of a cell, m.
    pub cell_m: f32,
    /// Height above the ground at which points reach the darkest colour, m.
    pub height_m: f32,
    /// Colours of points, from the ground up.
    pub heights: &'static [Colour],
    /// Width and height of a panel, units.
    pub side: f32,
    /// Pixels per unit; text is 13 units high.
    pub scale: f32,
    /// What colours and arrows mean, in rows below the panels.
    pub legend: Vec<LegendEntry>,
}

/// A sign of the legend and its meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct LegendEntry {
    /// The sign.
    pub sign: Sign,
    /// What it means.
    pub text: String,
}

/// A sign of the legend.
#[derive(Clone, Debug, PartialEq)]
pub enum Sign {
    /// A colour ramp, with labels for its ends.
    Ramp(&'static [Colour], [String; 2]),
    /// An arrow, `vector` m long at the picture's scale.
    Arrow(Arrow),
    /// A cell.
    Cell(Colour),
    /// A box.
    Outline(Colour),
    /// A line.
    Line(Pen),
}
