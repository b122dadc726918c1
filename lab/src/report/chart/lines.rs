//! Curves and dots over two axes.

use super::axis::{Axis, linear_label, log_label};
use super::colours::{INK, MARK, MUTED, ordered, series};
use super::legend::{Entry, Sign};
use super::{LETTER, Outcome, Sheet, font, px, styled};
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::combinators::IntoLogRange;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::element::{Circle, EmptyElement, Text};
use plotters::prelude::SVGBackend;
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor};

/// Curves or dots over two axes.
#[derive(Clone, Debug)]
pub struct Lines {
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves and dots.
    pub series: Vec<Series>,
    /// Dashed lines for comparison.
    pub guides: Vec<Guide>,
    /// Whether the series are ordered, such as by age: they are then coloured pale to dark.
    pub ordered: bool,
    /// Whether y is logarithmic: only values above zero are drawn.
    pub log_y: bool,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Shown in the legend; give n here.
    pub name: String,
    /// x and y; a point that cannot be drawn interrupts the curve.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub style: Style,
    /// Labelled points on the curve, such as operating points.
    pub marks: Vec<Mark>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Style {
    /// Straight from point to point.
    Line,
    /// A dot for each point.
    Dots,
}

/// A labelled point.
#[derive(Clone, Debug)]
pub struct Mark {
    /// x and y.
    pub at: [f64; 2],
    /// Shown beside it.
    pub label: String,
}

/// A dashed line across the plot, named in the legend.
#[derive(Clone, Debug)]
pub enum Guide {
    /// Horizontal, at this y.
    Y(f64, String),
    /// Where y equals x.
    Diagonal(String),
}

type Plane<'a, 'b, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, Y>>;

impl Lines {
    /// An empty plot with these axes.
    pub fn new(x: Axis, y: Axis) -> Lines {
        let (series, guides) = (Vec::new(), Vec::new());
        Lines { x, y, series, guides, ordered: false, log_y: false }
    }

    fn colour(&self, i: usize) -> RGBColor {
        if self.ordered { ordered(i, self.series.len()) } else { series(i) }
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        let sign = |i: usize, s: &Series| match s.style {
            Style::Dots => Sign::Dot(self.colour(i)),
            Style::Line => Sign::Line(self.colour(i)),
        };
        let curves = self.series.iter().enumerate();
        let curves = curves.map(|(i, s)| Entry { name: s.name.clone(), sign: sign(i, s) });
        let guides = self.guides.iter().map(|guide| match guide {
            Guide::Y(_, name) | Guide::Diagonal(name) => {
                Entry { name: name.clone(), sign: Sign::Dashed(MUTED) }
            }
        });
        curves.chain(guides).collect()
    }

    fn is_drawable(&self, [x, y]: [f64; 2]) -> bool {
        x.is_finite() && y.is_finite() && !(self.log_y && y <= 0.0)
    }

    pub(super) fn draw(&self, sheet: &Sheet) -> Outcome {
        let points = self.series.iter().flat_map(|s| s.points.iter().copied());
        let points: Vec<_> = points.filter(|p| self.is_drawable(*p)).collect();
        let levels = self.guides.iter().filter_map(|guide| match guide {
            Guide::Y(y, _) => Some(*y).filter(|y| self.is_drawable([0.0, *y])),
            Guide::Diagonal(_) => None,
        });
        let x = self.x.ends(points.iter().map(|p| p[0]));
        let y = self.y.ends(points.iter().map(|p| p[1]).chain(levels));
        let (Some(x), Some(y), false) = (x, y, points.is_empty()) else { return Ok(false) };
        let mut builder = ChartBuilder::on(sheet);
        builder.margin_top(px(10.0)).margin_right(px(22.0));
        builder.x_label_area_size(px(42.0)).y_label_area_size(px(64.0));
        if self.log_y {
            let least = points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
            let y = y.start.max(0.8 * least).max(1e-9 * y.end)..y.end;
            self.draw_on(builder.build_cartesian_2d(x, y.log_scale())?, &log_label)
        } else {
            let label = linear_label(y.clone());
            self.draw_on(builder.build_cartesian_2d(x, y)?, &label)
        }
    }

    fn draw_on<Y>(&self, mut plane: Plane<Y>, y_label: &dyn Fn(&f64) -> String) -> Outcome
    where
        Y: Ranged<ValueType = f64> + ValueFormatter<f64> + AsRangedCoord,
    {
        let (x, y) = (plane.x_range(), plane.y_range());
        let x_label = linear_label(x.clone());
        let mut mesh = plane.configure_mesh();
        styled(&mut mesh);
        mesh.disable_x_mesh().x_label_formatter(&x_label).y_label_formatter(y_label);
        mesh.x_desc(&self.x.label).y_desc(&self.y.label).draw()?;
        let inside = |[a, b]: [f64; 2]| {
            self.is_drawable([a, b])
                && (x.start..=x.end).contains(&a)
                && (y.start..=y.end).contains(&b)
        };
        for guide in &self.guides {
            let points = match guide {
                Guide::Y(level, _) => vec![[x.start, *level], [x.end, *level]],
                // In segments: on a logarithmic axis it is not a straight line.
                Guide::Diagonal(_) => (0..=64)
                    .map(|i| x.start + (x.end - x.start) * f64::from(i) / 64.0)
                    .map(|v| [v, v])
                    .collect(),
            };
            let points = points.into_iter().filter(|p| inside(*p)).map(|[a, b]| (a, b));
            let style = MUTED.stroke_width(px(1.3) as u32);
            plane.draw_series(DashedLineSeries::new(
                points,
                px(5.0) as u32,
                px(4.0) as u32,
                style,
            ))?;
        }
        for (i, s) in self.series.iter().enumerate() {
            let colour = self.colour(i);
            for run in s.points.split(|p| !inside(*p)) {
                let run = run.iter().map(|&[a, b]| (a, b));
                if s.style == Style::Line && run.len() > 1 {
                    plane.draw_series(LineSeries::new(run, colour.stroke_width(px(2.2) as u32)))?;
                } else {
                    let opacity = if s.points.len() > 200 { 0.35 } else { 0.9 };
                    let dot = |at| Circle::new(at, px(2.5), colour.mix(opacity).filled());
                    plane.draw_series(run.map(dot))?;
                }
            }
        }
        let marks = self.series.iter().flat_map(|s| &s.marks).filter(|m| inside(m.at));
        plane.draw_series(marks.enumerate().map(|(n, mark)| {
            // Alternately on either side of a falling curve.
            let sides = [(px(-9.0), px(5.0), HPos::Right), (px(9.0), px(-5.0), HPos::Left)];
            let (x, y, side) = sides[n % 2];
            EmptyElement::at((mark.at[0], mark.at[1]))
                + Circle::new((0, 0), px(4.6), MARK.filled())
                + Text::new(mark.label.clone(), (x, y), font(LETTER, INK, side))
        }))?;
        Ok(true)
    }

    pub(super) fn table(&self) -> Vec<Vec<String>> {
        let (x, y) = (self.x.label.clone(), self.y.label.clone());
        let mut rows = vec![vec!["series".into(), x, y, "mark".into()]];
        let row = |s: &Series, [x, y]: [f64; 2], mark: &str| {
            vec![s.name.clone(), x.to_string(), y.to_string(), mark.into()]
        };
        for s in &self.series {
            rows.extend(s.points.iter().map(|&p| row(s, p, "")));
            rows.extend(s.marks.iter().map(|m| row(s, m.at, &m.label)));
        }
        rows
    }
}

impl Series {
    /// A curve.
    pub fn line(name: &str, points: Vec<[f64; 2]>) -> Series {
        Series { name: name.into(), points, style: Style::Line, marks: Vec::new() }
    }
}
