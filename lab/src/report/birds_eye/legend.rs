//! What the colours and arrows of all panels mean.

use super::{ESTIMATE, Look, Panel, SIZE, TRUTH, rect};
use crate::labels::Kind;
use crate::report::palette::{self, INK, MUTED};
use crate::report::svg::{Anchor, Area, Svg, width};
use std::collections::BTreeSet;

/// Between the rows of the legend, units.
const ROW: f64 = 26.0;

/// A row of errors and arrows and a row of classes; of what is drawn only.
pub(super) fn draw(svg: &mut Svg, panels: &[Panel], look: &Look, y: f64) {
    let columns = || panels.iter().flat_map(|p| &p.columns);
    let mut x = 0.0;
    if columns().any(|c| c.error.is_some()) {
        x = draw_error_scale(svg, look, y);
    }
    for (name, colour, thick, any) in [
        ("true", TRUTH, 3.4, columns().any(|c| c.truth.is_some())),
        ("estimated", ESTIMATE, 1.5, columns().any(|c| c.estimate.is_some())),
    ] {
        if any {
            let sign = format!(
                "<path d=\"M0 0H18\" stroke=\"{colour}\" stroke-width=\"{thick}\"/>\
                 <path d=\"M26 0L17 -4.5V4.5Z\" fill=\"{colour}\"/>"
            );
            x = draw_word(svg, [x, y], &sign, 26.0, &format!("{name}, {}", look.arrows));
        }
    }
    // Where there is no first row, the second is the first.
    let [mut x, y] = if x > 0.0 { [0.0, y + ROW] } else { [x, y] };
    let kinds: BTreeSet<Kind> = panels.iter().flat_map(|p| &p.outlines).map(|o| o.kind).collect();
    for kind in kinds {
        let (name, colour) = palette::kind(kind);
        let sign = format!(
            "<rect x=\"0\" y=\"-6\" width=\"18\" height=\"12\" rx=\"1\" fill=\"{colour}\" \
             fill-opacity=\"0.08\" stroke=\"{colour}\" stroke-width=\"1.6\"/>"
        );
        x = draw_word(svg, [x, y], &sign, 18.0, name);
    }
}

/// A sign and its meaning; returns where the next begins.
fn draw_word(svg: &mut Svg, [x, y]: [f64; 2], sign: &str, wide: f64, text: &str) -> f64 {
    svg.raw(&format!("<g transform=\"translate({x:.1} {y})\">{sign}</g>"));
    svg.text([x + wide + 7.0, y + 4.4], text, SIZE, Anchor::Start, INK);
    x + wide + 7.0 + width(text, SIZE) + 16.0
}

/// A ramp of colours with its ends; returns where it ends.
fn draw_error_scale(svg: &mut Svg, look: &Look, y: f64) -> f64 {
    let mut x = width(&look.error, SIZE) + 10.0;
    svg.text([0.0, y + 4.4], &look.error, SIZE, Anchor::Start, INK);
    svg.text([x, y + 4.4], "0", SIZE, Anchor::Start, MUTED);
    x += 14.0;
    for i in 0..24 {
        let area = Area { left: x + 4.0 * f64::from(i), top: y - 6.0, width: 4.3, height: 12.0 };
        svg.raw(&rect(area, &palette::goodness(f64::from(i) / 23.0)));
    }
    x += 24.0 * 4.0 + 6.0;
    let end = format!("≥ {}", look.worst);
    svg.text([x, y + 4.4], &end, SIZE, Anchor::Start, MUTED);
    x + width(&end, SIZE) + 22.0
}
