//! The legend: what colours and arrows mean, in rows below the panels.

use crate::canvas::{Align, Canvas, Pen};
use crate::colours::{Colour, INK, MUTED, ramp};
use crate::panel::{draw_arrow, draw_box};
use crate::scene::{LegendEntry, Look, Sign};
use crate::text;

/// Height of a row and of its text, units.
const ROW: f32 = 26.0;
const SIZE: f32 = 13.0;
/// Space between entries, and between a sign and its text, units.
const GAP: f32 = 22.0;
const SPACE: f32 = 7.0;
/// Widths of a ramp, of a sign without its own width, and of a cell, units.
const RAMP: f32 = 96.0;
const SIGN: f32 = 20.0;
const CELL: f32 = 10.0;

/// Arranges the entries in rows, as many in each as fit.
pub(crate) fn rows(look: &Look, wide: f32) -> Vec<Vec<&LegendEntry>> {
    let mut rows: Vec<Vec<&LegendEntry>> = Vec::new();
    let mut x = wide;
    for entry in &look.legend {
        let width = entry_width(entry, look);
        if x + width > wide {
            rows.push(Vec::new());
            x = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push(entry);
        }
        x += width + GAP;
    }
    rows
}

/// Height of all rows, units.
pub(crate) fn height(rows: &[Vec<&LegendEntry>]) -> f32 {
    if rows.is_empty() { 0.0 } else { 12.0 + ROW * rows.len() as f32 }
}

/// Draws rows from the upper left corner `at`.
pub(crate) fn draw(canvas: &mut Canvas, rows: &[Vec<&LegendEntry>], look: &Look, at: [f32; 2]) {
    let mut y = at[1] + 12.0 + 0.5 * ROW;
    for row in rows {
        let mut x = at[0];
        for entry in row {
            draw_sign(canvas, &entry.sign, look, [x, y]);
            let text = [x + sign_width(&entry.sign, look) + SPACE, y + 4.4];
            canvas.text(text, &entry.text, SIZE, Align::Start, INK);
            x += entry_width(entry, look) + GAP;
        }
        y += ROW;
    }
}

fn entry_width(entry: &LegendEntry, look: &Look) -> f32 {
    sign_width(&entry.sign, look) + SPACE + text::width(&entry.text, SIZE)
}

fn sign_width(sign: &Sign, look: &Look) -> f32 {
    match sign {
        Sign::Ramp(_, [low, high]) => {
            RAMP + 2.0 * SPACE + text::width(low, SIZE) + text::width(high, SIZE)
        }
        Sign::Arrow(arrow) => pixels(look, arrow.vector[0].abs()).max(SIGN),
        Sign::Cell(_) => CELL,
        Sign::Outline(_) | Sign::Line(_) => SIGN,
    }
}

/// Length of some metres on a panel, units, limited to what fits a legend.
fn pixels(look: &Look, metres: f32) -> f32 {
    (metres * look.per_m()).min(0.5 * look.side)
}

fn draw_sign(canvas: &mut Canvas, sign: &Sign, look: &Look, [x, y]: [f32; 2]) {
    match sign {
        Sign::Ramp(colours, ends) => draw_ramp(canvas, colours, ends, [x, y]),
        Sign::Arrow(arrow) => {
            let long = pixels(look, arrow.vector[0].abs());
            draw_arrow(canvas, [x, y], [x + long, y], arrow.width, arrow.colour);
        }
        Sign::Cell(colour) => {
            canvas.square([x + 0.5 * CELL, y], CELL, *colour, 1.0);
        }
        Sign::Outline(colour) => {
            let (right, top, bottom) = (x + SIGN, y - 6.0, y + 6.0);
            draw_box(canvas, &[[x, top], [right, top], [right, bottom], [x, bottom]], *colour);
        }
        Sign::Line(pen) => canvas.line(&[[x, y], [x + SIGN, y]], false, Pen { ..*pen }),
    }
}

fn draw_ramp(canvas: &mut Canvas, colours: &[Colour], [low, high]: &[String; 2], at: [f32; 2]) {
    const STEPS: usize = 32;
    let [mut x, y] = at;
    canvas.text([x, y + 4.4], low, SIZE, Align::Start, MUTED);
    x += text::width(low, SIZE) + SPACE;
    let step = RAMP / STEPS as f32;
    for i in 0..STEPS {
        let colour = ramp(colours, i as f32 / (STEPS - 1) as f32);
        canvas.rect([x + step * i as f32, y - 6.0], [step + 1.0, 12.0], colour, 1.0);
    }
    canvas.text([x + RAMP + SPACE, y + 4.4], high, SIZE, Align::Start, MUTED);
}
