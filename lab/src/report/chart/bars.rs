//! Bars from left to right: times of stages, figures beside reference figures.

use super::legend::{Entry, Sign};
use super::scale::{Axis, Scale};
use crate::report::encode::short;
use crate::report::palette::{AXIS, GRID, INK, MUTED, Paint, REFERENCE, series};
use crate::report::svg::{Anchor, Area, Stroke, Svg, width};

const SIZE: f64 = 12.5;
const BAR: f64 = 17.0;
const BETWEEN: f64 = 13.0;
const FOOT: f64 = 44.0;

/// One bar of every series for every category.
#[derive(Clone, Debug)]
pub struct Bars {
    /// Quantity and unit; bars begin at zero, so it cannot be logarithmic.
    pub x: Axis,
    /// From the top down.
    pub categories: Vec<String>,
    /// What is compared in each.
    pub series: Vec<BarSeries>,
}

/// Bars of one colour.
#[derive(Clone, Debug)]
pub struct BarSeries {
    /// In the legend.
    pub name: String,
    /// Whether these are somebody else's figures: they are then grey.
    pub reference: bool,
    /// One for each category; where it is absent there is none to tell.
    pub bars: Vec<Option<Bar>>,
}

/// One bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Its length.
    pub value: f64,
    /// A thin line from and to, such as a confidence interval or median to p99.
    pub spread: Option<[f64; 2]>,
}

impl From<f64> for Bar {
    fn from(value: f64) -> Bar {
        Bar { value, spread: None }
    }
}

impl Bars {
    fn paint(&self, i: usize) -> Paint {
        if self.series[i].reference { REFERENCE } else { series(i) }
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        if self.series.len() < 2 {
            return Vec::new();
        }
        let named = self.series.iter().enumerate();
        named
            .map(|(i, s)| Entry { name: s.name.clone(), sign: Sign::Block(self.paint(i), 1.0) })
            .collect()
    }

    fn group_height(&self) -> f64 {
        BAR * self.series.len().max(1) as f64 + BETWEEN
    }

    pub(super) fn height(&self) -> f64 {
        self.group_height() * self.categories.len().max(2) as f64 + FOOT + 8.0
    }

    pub(super) fn draw(&self, svg: &mut Svg, area: Area) {
        let bars = self.series.iter().flat_map(|s| s.bars.iter().flatten());
        let values: Vec<f64> = bars
            .flat_map(|b| [Some(b.value), b.spread.map(|s| s[0]), b.spread.map(|s| s[1])])
            .flatten()
            .filter(|v| v.is_finite())
            .collect();
        let linear = Axis { log: false, ..self.x.clone() };
        let zero = (!values.is_empty()).then_some(0.0);
        let Some(scale) = Scale::new(&linear, values.into_iter().chain(zero)) else {
            return super::no_data(svg, area);
        };
        let names = self.categories.iter().map(|c| width(c, SIZE));
        let gutter = names.fold(0.0, f64::max).min(0.45 * area.width);
        let inner = area.inset(gutter + 12.0, 4.0, 52.0, FOOT);
        let x = |v: f64| Some(inner.left + inner.width * scale.place(v)?);
        let start = x(0.0).unwrap_or(inner.left).clamp(inner.left, inner.right());
        draw_axis(svg, inner, &scale, &self.x.label);
        for (i, category) in self.categories.iter().enumerate() {
            let top = inner.top + self.group_height() * i as f64 + 0.5 * BETWEEN;
            let middle = top + 0.5 * BAR * self.series.len() as f64;
            let at = [inner.left - 12.0, middle + 4.4];
            svg.text(at, category, SIZE, Anchor::End, INK);
            for (j, s) in self.series.iter().enumerate() {
                let area = Area { top: top + BAR * j as f64, height: BAR - 3.0, ..inner };
                let Some(bar) = s.bars.get(i).copied().flatten() else { continue };
                draw_bar(svg, bar, area, start, &x, self.paint(j));
            }
        }
        svg.line([start, inner.top], [start, inner.bottom()], Stroke::thin(AXIS));
    }

    pub(super) fn table(&self) -> Vec<Vec<String>> {
        let header = ["category", "series", &self.x.label, "from", "to"].map(String::from);
        let mut rows = vec![header.to_vec()];
        for (i, category) in self.categories.iter().enumerate() {
            for s in &self.series {
                let Some(bar) = s.bars.get(i).copied().flatten() else { continue };
                let [from, to] = match bar.spread {
                    Some(ends) => ends.map(|v| v.to_string()),
                    None => [String::new(), String::new()],
                };
                let value = bar.value.to_string();
                rows.push(vec![category.clone(), s.name.clone(), value, from, to]);
            }
        }
        rows
    }
}

fn draw_axis(svg: &mut Svg, a: Area, scale: &Scale, label: &str) {
    for (value, text) in &scale.ticks {
        let Some(place) = scale.place(*value) else { continue };
        let x = a.left + a.width * place;
        svg.line([x, a.top], [x, a.bottom()], Stroke::thin(GRID));
        svg.text([x, a.bottom() + 16.0], text, 12.0, Anchor::Middle, MUTED);
    }
    svg.text([a.left + 0.5 * a.width, a.bottom() + 36.0], label, 12.0, Anchor::Middle, MUTED);
}

/// A bar from `start`, its spread and its number.
fn draw_bar(
    svg: &mut Svg,
    bar: Bar,
    a: Area,
    start: f64,
    x: &impl Fn(f64) -> Option<f64>,
    paint: Paint,
) {
    let middle = a.top + 0.5 * a.height;
    let Some(end) = x(bar.value) else {
        return svg.text([start + 6.0, middle + 4.2], "no data", 12.0, Anchor::Start, MUTED);
    };
    let end = end.clamp(a.left, a.right());
    let (left, width) = (start.min(end), (end - start).abs());
    svg.rect(Area { left, width, ..a }, 1.5, paint, 1.0);
    let mut reach = start.max(end);
    if let Some([from, to]) = bar.spread.and_then(|[a, b]| Some([x(a)?, x(b)?])) {
        let [from, to] = [from, to].map(|v| v.clamp(a.left, a.right()));
        svg.line([from, middle], [to, middle], Stroke::thin(INK));
        for at in [from, to] {
            svg.line([at, middle - 3.5], [at, middle + 3.5], Stroke::thin(INK));
        }
        reach = reach.max(from).max(to);
    }
    svg.text([reach + 6.0, middle + 4.2], &short(bar.value), 12.0, Anchor::Start, INK);
}
