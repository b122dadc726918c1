//! Curves and dots over two axes.

use super::frame::Frame;
use super::legend::{Entry, Sign};
use super::marks;
use super::scale::{Axis, Scale};
use crate::report::palette::{MUTED, Paint, ordered, series};
use crate::report::svg::{Area, Stroke, Svg};

/// A cumulative distribution is drawn through so many of its values at most.
const CDF_POINTS: usize = 400;

/// Curves or dots over two axes.
#[derive(Clone, Debug)]
pub struct Lines {
    /// To the right.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// What is drawn.
    pub series: Vec<Series>,
    /// Dashed lines to compare with.
    pub guides: Vec<Guide>,
    /// Whether the series have an order, such as ages: they are then coloured pale to dark.
    pub ordered: bool,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// In the legend; give n here.
    pub name: String,
    /// x and y; a point that is not finite interrupts the curve.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub style: Style,
    /// Places upon it worth a word, such as operating points.
    pub marks: Vec<Mark>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Style {
    /// Straight from point to point.
    Line,
    /// A dot each.
    Dots,
    /// Dots joined by lines: few points, each of which counts.
    DotsAndLine,
    /// Dashed and grey: somebody else's curve.
    Reference,
}

/// A place with a word.
#[derive(Clone, Debug)]
pub struct Mark {
    /// x and y.
    pub at: [f64; 2],
    /// Beside it.
    pub label: String,
}

/// A dashed line across the plot, named in the legend.
#[derive(Clone, Debug)]
pub enum Guide {
    /// Upright at x.
    X(f64, String),
    /// Level at y.
    Y(f64, String),
    /// Where y equals x.
    Diagonal(String),
}

impl Lines {
    /// Nothing yet over two axes.
    pub fn new(x: Axis, y: Axis) -> Lines {
        Lines { x, y, series: Vec::new(), guides: Vec::new(), ordered: false }
    }

    fn paint(&self, i: usize) -> Paint {
        match self.series[i].style {
            Style::Reference => MUTED,
            _ if self.ordered => ordered(i, self.series.len()),
            _ => series(i),
        }
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        let sign = |i: usize, s: &Series| match s.style {
            Style::Reference => Sign::Dashed(MUTED),
            Style::Dots => Sign::Dot(self.paint(i)),
            _ => Sign::Line(self.paint(i)),
        };
        let curves = self.series.iter().enumerate();
        let curves = curves.map(|(i, s)| Entry { name: s.name.clone(), sign: sign(i, s) });
        let guides = self.guides.iter().map(|guide| match guide {
            Guide::X(_, name) | Guide::Y(_, name) | Guide::Diagonal(name) => {
                Entry { name: name.clone(), sign: Sign::Dashed(MUTED) }
            }
        });
        curves.chain(guides).collect()
    }

    pub(super) fn draw(&self, svg: &mut Svg, area: Area) {
        let Some(frame) = self.frame(area) else { return super::no_data(svg, area) };
        frame.draw(svg, &self.x, &self.y);
        svg.clip(frame.area.inset(-1.0, -2.0, -2.0, -1.0));
        for guide in &self.guides {
            draw_guide(svg, &frame, guide);
        }
        for (i, s) in self.series.iter().enumerate() {
            draw_series(svg, &frame, s, self.paint(i));
        }
        svg.end_clip();
        marks::draw(svg, &frame, &self.series);
    }

    /// Axes for all points that have both coordinates.
    fn frame(&self, area: Area) -> Option<Frame> {
        let whole = |p: &&[f64; 2]| {
            let shown = |v: f64, axis: &Axis| v.is_finite() && !(axis.log && v <= 0.0);
            shown(p[0], &self.x) && shown(p[1], &self.y)
        };
        let points = || self.series.iter().flat_map(|s| &s.points).filter(whole);
        points().next()?;
        let (mut xs, mut ys): (Vec<f64>, Vec<f64>) = points().map(|p| (p[0], p[1])).unzip();
        for guide in &self.guides {
            match guide {
                Guide::X(x, _) => xs.push(*x),
                Guide::Y(y, _) => ys.push(*y),
                Guide::Diagonal(_) => {}
            }
        }
        Some(Frame::new(area, Scale::new(&self.x, xs)?, Scale::new(&self.y, ys)?))
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

    /// The share of values (percent, of those that are numbers) up to each of them, in 400 steps of
    /// equal share at most; the name gets the number of values.
    pub fn cdf(name: &str, values: &[f64]) -> Series {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let steps = n.min(CDF_POINTS);
        let point = |i: usize| {
            let rank = i * n / steps;
            [sorted[rank - 1], 100.0 * rank as f64 / n as f64]
        };
        let start = sorted.first().map(|&v| [v, 0.0]);
        let points = start.into_iter().chain((1..=steps).map(point)).collect();
        Series::line(&format!("{name} (n = {})", crate::report::encode::fixed(n as f64, 0)), points)
    }

    /// The same in another style.
    pub fn style(self, style: Style) -> Series {
        Series { style, ..self }
    }

    /// The same with a mark.
    pub fn mark(mut self, at: [f64; 2], label: &str) -> Series {
        self.marks.push(Mark { at, label: label.into() });
        self
    }
}

fn draw_guide(svg: &mut Svg, frame: &Frame, guide: &Guide) {
    let a = frame.area;
    let ends = match guide {
        Guide::X(x, _) => frame.x_at(*x).map(|x| [[x, a.top], [x, a.bottom()]]),
        Guide::Y(y, _) => frame.y_at(*y).map(|y| [[a.left, y], [a.right(), y]]),
        Guide::Diagonal(_) => None,
    };
    if let Some([from, to]) = ends {
        svg.line(from, to, Stroke::dashed(MUTED));
    }
    if let Guide::Diagonal(_) = guide {
        // By parts: on a logarithmic axis it is no straight line.
        let along = |i: i32| frame.diagonal(f64::from(i) / 64.0);
        let points: Vec<_> = (0..=64).filter_map(along).collect();
        svg.polyline(&points, Stroke::dashed(MUTED));
    }
}

fn draw_series(svg: &mut Svg, frame: &Frame, s: &Series, paint: Paint) {
    let places: Vec<Option<[f64; 2]>> = s.points.iter().map(|&p| frame.at(p)).collect();
    if s.style != Style::Dots {
        let stroke = match s.style {
            Style::Reference => Stroke { paint, width: 1.8, dashes: "6 4" },
            _ => Stroke { paint, width: 2.2, dashes: "" },
        };
        for run in places.split(Option::is_none) {
            let run: Vec<[f64; 2]> = run.iter().flatten().copied().collect();
            match run[..] {
                [] => {}
                [alone] => svg.disc(alone, 3.0, paint, 1.0),
                _ => svg.polyline(&run, stroke),
            }
        }
    }
    let many = s.points.len() > 200;
    let (radius, opacity) = match s.style {
        Style::Dots if many => (2.0, 0.35),
        Style::Dots | Style::DotsAndLine => (3.6, 0.9),
        _ => return,
    };
    for at in places.into_iter().flatten() {
        svg.disc(at, radius, paint, opacity);
    }
}
