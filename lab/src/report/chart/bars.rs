//! Horizontal bars: times of stages, figures beside reference figures.

use super::axis::{Axis, linear_label};
use super::colours::{INK, REFERENCE, series};
use super::legend::{Entry, Sign};
use super::{LETTER, Outcome, Sheet, font, px, styled, width};
use crate::report::encode::short;
use plotters::chart::ChartBuilder;
use plotters::element::{EmptyElement, PathElement, Rectangle, Text};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor};

/// Thickness of a bar and space between two categories, units.
const BAR: f64 = 17.0;
const BETWEEN: f64 = 13.0;
/// Height of the axis below, units.
const FOOT: f64 = 42.0;

/// One bar of every series for every category.
#[derive(Clone, Debug)]
pub struct Bars {
    /// Quantity and unit; bars begin at zero.
    pub x: Axis,
    /// From the top down.
    pub categories: Vec<String>,
    /// What is compared in each.
    pub series: Vec<BarSeries>,
}

/// Bars of one colour.
#[derive(Clone, Debug)]
pub struct BarSeries {
    /// Shown in the legend.
    pub name: String,
    /// Whether these are someone else's figures: they are then grey.
    pub reference: bool,
    /// One for each category; `None` if there is no value.
    pub bars: Vec<Option<Bar>>,
}

/// One bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Its length.
    pub value: f64,
    /// Ends of a thin line, such as a confidence interval or median to p99.
    pub spread: Option<[f64; 2]>,
}

impl From<f64> for Bar {
    fn from(value: f64) -> Bar {
        Bar { value, spread: None }
    }
}

impl Bar {
    /// How far the bar and its spread reach.
    fn reach(&self) -> f64 {
        self.spread.map_or(self.value, |[_, to]| to.max(self.value))
    }
}

impl Bars {
    fn colour(&self, i: usize) -> RGBColor {
        if self.series[i].reference { REFERENCE } else { series(i) }
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        if self.series.len() < 2 {
            return Vec::new();
        }
        let named = self.series.iter().enumerate();
        named
            .map(|(i, s)| Entry { name: s.name.clone(), sign: Sign::Block(self.colour(i)) })
            .collect()
    }

    fn group_height(&self) -> f64 {
        BAR * self.series.len().max(1) as f64 + BETWEEN
    }

    pub(super) fn height(&self) -> f64 {
        self.group_height() * self.categories.len().max(2) as f64 + FOOT + 8.0
    }

    /// Category, series and bar of everything that can be drawn.
    fn drawable(&self) -> impl Iterator<Item = (usize, usize, Bar)> {
        let mut all = Vec::new();
        for (j, s) in self.series.iter().enumerate() {
            let bars = s.bars.iter().enumerate().take(self.categories.len());
            all.extend(bars.filter_map(|(i, bar)| Some((i, j, (*bar)?))));
        }
        all.into_iter().filter(|(.., bar)| bar.value >= 0.0 && bar.reach().is_finite())
    }

    pub(super) fn draw(&self, sheet: &Sheet) -> Outcome {
        let reaches: Vec<f64> = self.drawable().map(|(.., bar)| bar.reach()).collect();
        let (Some(x), false) =
            (self.x.ends(reaches.iter().copied().chain([0.0])), reaches.is_empty())
        else {
            return Ok(false);
        };
        let names = self.categories.iter().map(|c| width(c, LETTER)).fold(0.0, f64::max);
        let down = self.group_height() * self.categories.len() as f64;
        let mut plane = ChartBuilder::on(sheet)
            .margin_right(px(56.0))
            .x_label_area_size(px(FOOT))
            .y_label_area_size(px(names.min(0.4 * super::WIDTH) + 12.0))
            .build_cartesian_2d(x.clone(), down..0.0)?;
        // Whatever lies beyond a given end is cut off there.
        let within = |v: f64| v.clamp(x.start, x.end);
        let x_label = linear_label(x.clone());
        let mut mesh = plane.configure_mesh();
        styled(&mut mesh);
        mesh.disable_y_mesh().y_labels(0).x_label_formatter(&x_label).x_desc(&self.x.label);
        mesh.draw()?;
        let middle = |i: usize, j: usize| {
            self.group_height() * i as f64 + 0.5 * BETWEEN + BAR * (j as f64 + 0.5)
        };
        for (i, category) in self.categories.iter().enumerate() {
            let at = (x.start, 0.5 * (middle(i, 0) + middle(i, self.series.len() - 1)));
            let style = font(LETTER, INK, HPos::Right);
            let name = Text::new(category.clone(), (px(-8.0), 0), style);
            plane.draw_series([EmptyElement::at(at) + name])?;
        }
        for (i, j, bar) in self.drawable() {
            let (y, half) = (middle(i, j), 0.5 * BAR - 1.5);
            let block = [(within(0.0), y - half), (within(bar.value), y + half)];
            plane.draw_series([Rectangle::new(block, self.colour(j).filled())])?;
            if let Some([from, to]) = bar.spread.map(|ends| ends.map(within)) {
                let style = INK.stroke_width(px(1.0) as u32);
                plane.draw_series([PathElement::new([(from, y), (to, y)], style)])?;
                let ends =
                    [from, to].map(|v| PathElement::new([(v, y - 3.5), (v, y + 3.5)], style));
                plane.draw_series(ends)?;
            }
            let value = Text::new(short(bar.value), (px(6.0), 0), font(LETTER, INK, HPos::Left));
            plane.draw_series([EmptyElement::at((within(bar.reach()), y)) + value])?;
        }
        Ok(true)
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
