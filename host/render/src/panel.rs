//! One panel.

use crate::canvas::{Align, Canvas, Pen, PictureError};
use crate::colours::{BORDER, Colour, GROUND, INK, MUTED, PAPER, RING, VEHICLE, clamped, ramp};
use crate::scene::{Arrow, Cell, Look, Outline, Panel};
use crate::text;
use std::collections::BTreeSet;

/// Width of a point, units.
const POINT: f32 = 1.6;
/// Height of text within a panel, units.
const SIZE: f32 = 12.0;
/// Distances between rings, m.
const RINGS_M: [f32; 12] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
/// More rings would hide what they measure.
const RINGS_MAX: usize = 10;
const HALF_SQRT_2: f32 = core::f32::consts::FRAC_1_SQRT_2;

impl Look {
    /// Units per metre.
    pub(crate) fn per_m(&self) -> f32 {
        0.5 * self.side / self.half_extent_m
    }

    /// Width of a cell, units, never too small for its colour to be visible.
    pub(crate) fn cell_side(&self) -> f32 {
        (self.cell_m * self.per_m()).max(2.6) - 0.6
    }
}

/// The mapping from metres to a panel.
pub(crate) struct PanelView<'a> {
    look: &'a Look,
}

impl PanelView<'_> {
    pub fn new(look: &Look) -> PanelView<'_> {
        PanelView { look }
    }

    /// Draws everything, from bottom to top.
    pub fn draw(&self, panel: &Panel) -> Result<Canvas, PictureError> {
        let side = self.look.side;
        let mut canvas = Canvas::new([side; 2], self.look.scale, GROUND)?;
        let c = &mut canvas;
        for tile in &panel.tiles {
            self.draw_cell(c, tile);
        }
        self.draw_points(c, &panel.points);
        if let Some(corners) = &panel.window {
            self.draw_window(c, &corners.map(|p| self.at(p)));
        }
        self.draw_rings(c);
        panel.cells.iter().for_each(|cell| self.draw_cell(c, cell));
        for trail in &panel.trails {
            let places: Vec<[f32; 2]> = trail.places.iter().map(|p| self.at(*p)).collect();
            c.line(&places, false, Pen::new(trail.colour, trail.width));
        }
        panel.outlines.iter().for_each(|outline| self.draw_outline(c, outline));
        let arrows = one_of_four(&panel.cells, self.look.cell_m);
        for layer in 0..2 {
            for (at, arrow) in arrows.iter().filter_map(|c| Some((c.at, c.arrows[layer]?))) {
                self.draw_arrow(c, at, &arrow);
            }
        }
        if panel.vehicle {
            self.draw_vehicle(c);
            self.draw_forward(c);
        }
        panel.outlines.iter().for_each(|outline| self.draw_label(c, outline));
        self.draw_ring_labels(c);
        self.draw_scale(c);
        Ok(canvas)
    }

    /// Converts a position to units from the panel's upper left corner.
    fn at(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let (middle, per_m) = (0.5 * self.look.side, self.look.per_m());
        [middle - y * per_m, middle - x * per_m]
    }

    /// As [`PanelView::at`]; `None` if outside the panel.
    fn seen(&self, at: [f32; 2]) -> Option<[f32; 2]> {
        let at = self.at(at);
        at.iter().all(|v| (0.0..self.look.side).contains(v)).then_some(at)
    }

    fn draw_points(&self, canvas: &mut Canvas, points: &[[f32; 3]]) {
        let seen = |p: &[f32; 3]| Some((p[2], self.seen([p[0], p[1]])?));
        let mut seen: Vec<(f32, [f32; 2])> =
            points.iter().filter(|p| p[2].is_finite()).filter_map(seen).collect();
        // From the ground up, so that objects on it stay visible.
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A tenth of the returns may lie below the ground: reflections.
        let Some(&(ground, _)) = seen.get(seen.len() / 10) else { return };
        for (z, at) in seen {
            let height = clamped((z - ground) / self.look.height_m);
            let colour = ramp(self.look.heights, height);
            canvas.square(at, POINT, colour, 0.6 + 0.35 * height);
        }
    }

    fn draw_window(&self, canvas: &mut Canvas, corners: &[[f32; 2]; 4]) {
        let side = self.look.side;
        let panel = [[-1.0; 2], [side + 1.0, -1.0], [side + 1.0; 2], [-1.0, side + 1.0]];
        canvas.frame(&panel, corners, PAPER, 0.55);
        canvas.line(corners, true, WINDOW);
    }

    /// Distance between rings, chosen so that three or four of them reach the border.
    fn ring_m(&self) -> f32 {
        let reach = 0.8 * self.look.half_extent_m;
        *RINGS_M.iter().find(|m| 4.0 * **m >= reach).unwrap_or(&1000.0)
    }

    fn rings(&self) -> impl Iterator<Item = f32> {
        let step = self.ring_m();
        let count = (self.look.half_extent_m / HALF_SQRT_2 / step) as usize;
        (1..=count.min(RINGS_MAX)).map(move |i| step * i as f32)
    }

    fn draw_rings(&self, canvas: &mut Canvas) {
        for radius in self.rings() {
            canvas.circle(self.at([0.0; 2]), radius * self.look.per_m(), Pen::new(RING, 1.0));
        }
    }

    fn draw_ring_labels(&self, canvas: &mut Canvas) {
        for radius in self.rings() {
            // On a diagonal, as roads run to the front, back and sides.
            let [x, y] = self.at([-radius * HALF_SQRT_2, radius * HALF_SQRT_2]);
            // Entirely or not at all.
            if x < 24.0 || y > self.look.side - 12.0 {
                continue;
            }
            self.draw_tag(canvas, [x, y], &format!("{radius} m"), MUTED);
        }
    }

    /// Text on a white tag, centred at `[x, y]`.
    fn draw_tag(&self, canvas: &mut Canvas, [x, y]: [f32; 2], text: &str, colour: Colour) {
        let wide = text::width(text, SIZE) + 5.0;
        canvas.rect([x - 0.5 * wide, y - 8.0], [wide, 16.0], PAPER, 0.8);
        canvas.text([x, y + 4.2], text, SIZE, Align::Middle, colour);
    }

    fn draw_cell(&self, canvas: &mut Canvas, cell: &Cell) {
        if let Some(at) = self.seen(cell.at) {
            canvas.square(at, self.look.cell_side(), cell.colour, 1.0);
        }
    }

    fn draw_arrow(&self, canvas: &mut Canvas, from: [f32; 2], arrow: &Arrow) {
        let Some(a) = self.seen(from) else { return };
        let b = self.at([from[0] + arrow.vector[0], from[1] + arrow.vector[1]]);
        draw_arrow(canvas, a, b, arrow.width, arrow.colour);
    }

    fn draw_outline(&self, canvas: &mut Canvas, outline: &Outline) {
        let [cos, sin] = outline.forward;
        let [long, wide] = outline.size.map(|v| 0.5 * v);
        let at = |x: f32, y: f32| {
            self.at([outline.at[0] + cos * x - sin * y, outline.at[1] + sin * x + cos * y])
        };
        let corners = [at(long, wide), at(long, -wide), at(-long, -wide), at(-long, wide)];
        draw_box(canvas, &corners, outline.colour);
        canvas.line(&[at(0.0, 0.0), at(long, 0.0)], false, Pen::new(outline.colour, 1.6));
        if let Some(arrow) = &outline.arrow {
            self.draw_arrow(canvas, outline.at, arrow);
        }
    }

    fn draw_label(&self, canvas: &mut Canvas, outline: &Outline) {
        let Some([x, y]) = self.seen(outline.at).filter(|_| !outline.label.is_empty()) else {
            return;
        };
        let below = 0.5 * outline.size[1].max(0.0) * self.look.per_m() + 12.0;
        self.draw_tag(canvas, [x, y + below.min(40.0)], &outline.label, outline.colour);
    }

    /// Draws a car around the origin with its windscreen to the front.
    fn draw_vehicle(&self, canvas: &mut Canvas) {
        let body = [[2.0, 0.9], [2.5, 0.6], [2.5, -0.6], [2.0, -0.9], [-2.0, -0.9], [-2.0, 0.9]];
        let screen = [[0.5, 0.65], [0.5, -0.65], [1.1, -0.75], [1.1, 0.75]];
        canvas.polygon(&body.map(|p| self.at(p)), VEHICLE, 1.0);
        canvas.polygon(&screen.map(|p| self.at(p)), [223, 229, 238], 1.0);
    }

    fn draw_scale(&self, canvas: &mut Canvas) {
        let metres = self.ring_m();
        let (right, y) = (self.look.side - 18.0, self.look.side - 18.0);
        let left = right - metres * self.look.per_m();
        canvas.rect([left - 10.0, y - 26.0], [right - left + 20.0, 36.0], PAPER, 0.85);
        let bar = [[left, y - 5.0], [left, y], [right, y], [right, y - 5.0]];
        canvas.line(&bar, false, Pen::new(INK, 1.6));
        let middle = [0.5 * (left + right), y - 9.0];
        canvas.text(middle, &format!("{metres} m"), SIZE, Align::Middle, INK);
    }

    fn draw_forward(&self, canvas: &mut Canvas) {
        canvas.rect([8.0, 8.0], [88.0, 40.0], PAPER, 0.85);
        draw_arrow(canvas, [24.0, 42.0], [24.0, 16.0], 1.6, INK);
        canvas.text([37.0, 33.0], "forward", SIZE, Align::Start, INK);
    }
}

/// Border of the window in which motion is estimated.
pub const WINDOW: Pen = Pen { colour: BORDER, width: 1.4, dashes: [6.0, 4.0] };

/// Draws a box.
pub(crate) fn draw_box(canvas: &mut Canvas, corners: &[[f32; 2]; 4], colour: Colour) {
    canvas.polygon(corners, colour, 0.1);
    canvas.line(corners, true, Pen::new(colour, 1.6));
}

/// Draws an arrow from `a` to `b`, units; short ones are all head, ones below 1.5 units are not
/// drawn.
pub(crate) fn draw_arrow(
    canvas: &mut Canvas,
    a: [f32; 2],
    b: [f32; 2],
    width: f32,
    colour: Colour,
) {
    let vector = [b[0] - a[0], b[1] - a[1]];
    // Not `hypot`, which differs between platforms.
    let long = (vector[0] * vector[0] + vector[1] * vector[1]).sqrt();
    if long.is_nan() || long < 1.5 {
        return;
    }
    let along = vector.map(|v| v / long);
    let size = (3.0 + 2.6 * width).min(long);
    let neck = [b[0] - along[0] * size, b[1] - along[1] * size];
    let side = [-along[1] * 0.42 * size, along[0] * 0.42 * size];
    canvas.line(&[a, neck], false, Pen::new(colour, width));
    let (left, right) =
        ([neck[0] + side[0], neck[1] + side[1]], [neck[0] - side[0], neck[1] - side[1]]);
    canvas.polygon(&[b, left, right], colour, 1.0);
}

/// Selects the first cell with an arrow in every block of 2 x 2.
fn one_of_four(cells: &[Cell], cell_m: f32) -> Vec<&Cell> {
    let mut taken = BTreeSet::new();
    // The cast saturates; non-finite values are not drawn anyway.
    let block = |c: &Cell| c.at.map(|v| (v / (2.0 * cell_m)).floor() as i64);
    let arrows = cells.iter().filter(|c| c.arrows.iter().any(Option::is_some));
    arrows.filter(|c| taken.insert(block(c))).collect()
}
