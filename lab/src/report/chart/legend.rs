//! Legends: rows of names above a plot, where they cannot cover data.

use super::colours::INK;
use super::{Drawn, LETTER, Sheet, font, px, width};
use plotters::element::{Circle, DashedPathElement, PathElement, Rectangle, Text};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor};

const ROW: f64 = 21.0;
const SWATCH: f64 = 22.0;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub name: String,
    pub sign: Sign,
}

/// How something looks in the plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sign {
    Line(RGBColor),
    Dashed(RGBColor),
    Dot(RGBColor),
    Block(RGBColor),
}

/// Positions of the entries from the upper left corner, and the total height, units.
fn places(entries: &[Entry], limit: f64) -> (Vec<[f64; 2]>, f64) {
    let (mut x, mut y) = (0.0, 0.0);
    let mut places = Vec::new();
    for entry in entries {
        let wide = SWATCH + 6.0 + width(&entry.name, LETTER) + 14.0;
        if x > 0.0 && x + wide > limit {
            (x, y) = (0.0, y + ROW);
        }
        places.push([x, y]);
        x += wide;
    }
    (places, if entries.is_empty() { 0.0 } else { y + ROW + 7.0 })
}

/// Height of a legend within this width, units.
pub(super) fn height(entries: &[Entry], limit: f64) -> f64 {
    places(entries, limit).1
}

/// Draws a legend within this width.
pub(super) fn draw(sheet: &Sheet, entries: &[Entry], limit: f64) -> Drawn {
    for (entry, [x, y]) in entries.iter().zip(places(entries, limit).0) {
        let at = |dx: f64, dy: f64| (px(x + dx), px(y + 0.5 * ROW + dy));
        let ends = [at(0.0, 0.0), at(SWATCH, 0.0)];
        match entry.sign {
            Sign::Line(c) => sheet.draw(&PathElement::new(ends, c.stroke_width(px(2.2) as u32)))?,
            Sign::Dashed(c) => {
                let style = c.stroke_width(px(1.3) as u32);
                sheet.draw(&DashedPathElement::new(ends, px(5.0), px(4.0), style))?;
            }
            Sign::Dot(c) => sheet.draw(&Circle::new(at(0.5 * SWATCH, 0.0), px(4.2), c.filled()))?,
            Sign::Block(c) => {
                sheet.draw(&Rectangle::new([at(5.0, -6.0), at(18.0, 6.0)], c.filled()))?;
            }
        }
        let style = font(LETTER, INK, HPos::Left);
        sheet.draw(&Text::new(entry.name.clone(), at(SWATCH + 6.0, 0.0), style))?;
    }
    Ok(())
}
