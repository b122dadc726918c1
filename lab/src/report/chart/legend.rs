//! Legends: rows of names above a plot, where they cannot cover data.

use crate::report::palette::{INK, Paint};
use crate::report::svg::{Anchor, Area, Stroke, Svg, width};

const SIZE: f64 = 12.5;
const ROW: f64 = 21.0;
const SWATCH: f64 = 22.0;

/// A name and what stands for it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub name: String,
    pub sign: Sign,
}

/// How a thing looks in the plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sign {
    Line(Paint),
    Dashed(Paint),
    Dot(Paint),
    Block(Paint, f64),
}

/// Places of the entries from the upper left corner, and the height in all.
fn places(entries: &[Entry], limit: f64) -> (Vec<[f64; 2]>, f64) {
    let (mut x, mut y) = (0.0, 0.0);
    let mut places = Vec::new();
    for entry in entries {
        let wide = SWATCH + 6.0 + width(&entry.name, SIZE) + 18.0;
        if x > 0.0 && x + wide > limit {
            (x, y) = (0.0, y + ROW);
        }
        places.push([x, y]);
        x += wide;
    }
    (places, if entries.is_empty() { 0.0 } else { y + ROW + 7.0 })
}

/// Height of a legend within this width.
pub(super) fn height(entries: &[Entry], limit: f64) -> f64 {
    places(entries, limit).1
}

/// Draws a legend and returns its height.
pub(super) fn draw(svg: &mut Svg, entries: &[Entry], [left, top]: [f64; 2], limit: f64) -> f64 {
    let (places, height) = places(entries, limit);
    for (entry, [x, y]) in entries.iter().zip(places) {
        let (x, middle) = (left + x, top + y + 0.5 * ROW);
        let ends = ([x, middle], [x + SWATCH, middle]);
        match entry.sign {
            Sign::Line(paint) => svg.line(ends.0, ends.1, Stroke { paint, width: 2.4, dashes: "" }),
            Sign::Dashed(paint) => svg.line(ends.0, ends.1, Stroke::dashed(paint)),
            Sign::Dot(paint) => svg.disc([x + 0.5 * SWATCH, middle], 4.2, paint, 0.9),
            Sign::Block(paint, opacity) => {
                let block = Area { left: x + 5.0, top: middle - 6.0, width: 13.0, height: 12.0 };
                svg.rect(block, 2.0, paint, opacity);
            }
        }
        svg.text([x + SWATCH + 6.0, middle + 4.3], &entry.name, SIZE, Anchor::Start, INK);
    }
    height
}
