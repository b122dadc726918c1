//! The two axes of a plot.

use super::scale::{Axis, Scale};
use crate::report::palette::{AXIS, GRID, MUTED};
use crate::report::svg::{Anchor, Area, Stroke, Svg, width};

const SIZE: f64 = 12.0;

/// Axes on their place.
pub(super) struct Frame {
    /// Between the axes.
    pub area: Area,
    x: Scale,
    y: Scale,
}

impl Frame {
    /// Axes within an area, which has room for their labels.
    pub fn new(area: Area, x: Scale, y: Scale) -> Frame {
        let widest = y.ticks.iter().map(|t| width(&t.1, SIZE)).fold(0.0, f64::max);
        // The last label of x reaches half its width beyond the axis.
        let over = x.ticks.last().map_or(0.0, |t| 0.5 * width(&t.1, SIZE)).min(40.0);
        Frame { area: area.inset(widest + 10.0, 24.0, over.max(6.0), 42.0), x, y }
    }

    /// Where a value lies on the drawing.
    pub fn at(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        Some([self.x_at(x)?, self.y_at(y)?])
    }

    pub fn x_at(&self, x: f64) -> Option<f64> {
        Some(self.area.left + self.area.width * self.x.place(x)?)
    }

    pub fn y_at(&self, y: f64) -> Option<f64> {
        Some(self.area.bottom() - self.area.height * self.y.place(y)?)
    }

    /// The place `t` (0 to 1) of the way along y = x, from the lowest to the highest labelled x.
    pub fn diagonal(&self, t: f64) -> Option<[f64; 2]> {
        let (first, last) = (self.x.ticks.first()?.0, self.x.ticks.last()?.0);
        let v = first + (last - first) * t;
        self.at([v, v])
    }

    /// Grid, labels of the values and names of both quantities.
    pub fn draw(&self, svg: &mut Svg, x: &Axis, y: &Axis) {
        let a = self.area;
        for (value, label) in &self.y.ticks {
            let Some(at) = self.y_at(*value) else { continue };
            svg.line([a.left, at], [a.right(), at], Stroke::thin(GRID));
            svg.text([a.left - 8.0, at + 4.2], label, SIZE, Anchor::End, MUTED);
        }
        svg.text([a.left, a.top - 10.0], &y.label, SIZE, Anchor::Start, MUTED);
        svg.line([a.left, a.bottom()], [a.right(), a.bottom()], Stroke::thin(AXIS));
        let mut free = f64::MIN;
        for (value, label) in &self.x.ticks {
            let Some(at) = self.x_at(*value) else { continue };
            svg.line([at, a.bottom()], [at, a.bottom() + 4.0], Stroke::thin(AXIS));
            let half = 0.5 * width(label, SIZE);
            if at - half > free {
                svg.text([at, a.bottom() + 18.0], label, SIZE, Anchor::Middle, MUTED);
                free = at + half + 4.0;
            }
        }
        let middle = a.left + 0.5 * a.width;
        svg.text([middle, a.bottom() + 37.0], &x.label, SIZE, Anchor::Middle, MUTED);
    }
}
