//! Charts: one description, drawn once as SVG (and from that as PNG) and listed as CSV.

mod bars;
mod frame;
mod histogram;
mod legend;
mod lines;
mod marks;
mod scale;

pub use bars::{Bar, BarSeries, Bars};
pub use histogram::Histogram;
pub use lines::{Guide, Lines, Mark, Series, Style};
pub use scale::Axis;

use super::encode;
use super::palette::{GRID, INK, MUTED};
use super::svg::{Anchor, Area, Stroke, Svg};
use legend::Entry;

/// Width of every chart within its margin, units.
const WIDTH: f64 = 720.0;

/// Around every chart, units.
const MARGIN: f64 = 8.0;

/// Between parts that stand side by side, units.
const GAP: f64 = 34.0;

/// Space for the title of a part, units.
const TITLE: f64 = 24.0;

/// A figure of one plot, or of several small ones that are to be compared.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Name of its files, unlike any other's in the report: letters, digits, `-` and `_`.
    pub id: String,
    /// What one sees, in which units, of how many.
    pub caption: String,
    parts: Vec<(String, Plot)>,
}

/// What a chart shows.
#[derive(Clone, Debug)]
pub enum Plot {
    /// Curves or dots over two axes.
    Lines(Lines),
    /// Counts in bins.
    Histogram(Histogram),
    /// Bars from left to right, to compare.
    Bars(Bars),
}

impl Chart {
    /// A single plot.
    pub fn new(id: &str, caption: &str, plot: Plot) -> Chart {
        Chart::small_multiples(id, caption, vec![(String::new(), plot)])
    }

    /// Small plots two by two, each under its title; axes are each plot's own.
    pub fn small_multiples(id: &str, caption: &str, parts: Vec<(String, Plot)>) -> Chart {
        Chart { id: id.into(), caption: caption.into(), parts }
    }

    /// The drawing and its width and height, units.
    pub(super) fn svg(&self) -> (String, [f64; 2]) {
        let columns = if self.parts.len() > 1 { 2 } else { 1 };
        let width = (WIDTH - GAP * (columns - 1) as f64) / columns as f64;
        let shared = self.shared_legend();
        let shared_height = legend::height(shared.as_deref().unwrap_or(&[]), WIDTH);
        let height_of = |(title, plot): &(String, Plot)| {
            let own = if shared.is_some() { 0.0 } else { legend::height(&plot.legend(), width) };
            plot.height(columns) + own + if title.is_empty() { 0.0 } else { TITLE }
        };
        let rows: Vec<f64> = self
            .parts
            .chunks(columns)
            .map(|row| row.iter().map(height_of).fold(0.0, f64::max))
            .collect();
        let gaps = GAP * 0.6 * rows.len().saturating_sub(1) as f64;
        let height = (shared_height + rows.iter().sum::<f64>() + gaps).max(40.0);
        let mut svg = Svg::new(WIDTH, height, MARGIN);
        if let Some(entries) = &shared {
            legend::draw(&mut svg, entries, [0.0, 0.0], WIDTH);
        }
        let mut top = shared_height;
        for (row, height) in self.parts.chunks(columns).zip(rows) {
            for (i, (title, plot)) in row.iter().enumerate() {
                let left = i as f64 * (width + GAP);
                let area = Area { left, top, width, height };
                draw_part(&mut svg, title, plot, area, shared.is_none());
            }
            top += height + 0.6 * GAP;
        }
        let size = svg.size();
        (svg.finish(&self.caption), size)
    }

    /// The legend of all parts where they have the same.
    fn shared_legend(&self) -> Option<Vec<Entry>> {
        let mut legends = self.parts.iter().map(|(_, plot)| plot.legend());
        let first = legends.next()?;
        legends.all(|l| l == first).then_some(first)
    }

    /// All numbers of the chart.
    pub(super) fn csv(&self) -> String {
        let mut rows: Vec<Vec<String>> = Vec::new();
        let mut header = Vec::new();
        for (title, plot) in &self.parts {
            let mut table = plot.table();
            if self.parts.len() > 1 {
                for (i, row) in table.iter_mut().enumerate() {
                    row.insert(0, if i == 0 { "part".into() } else { title.clone() });
                }
            }
            // Parts of one kind share a header.
            if table[0] != header {
                header.clone_from(&table[0]);
                rows.push(header.clone());
            }
            rows.extend(table.drain(1..));
        }
        encode::csv(&rows)
    }
}

impl Plot {
    fn legend(&self) -> Vec<Entry> {
        match self {
            Plot::Lines(lines) => lines.legend(),
            Plot::Histogram(histogram) => histogram.legend(),
            Plot::Bars(bars) => bars.legend(),
        }
    }

    fn height(&self, columns: usize) -> f64 {
        match self {
            Plot::Bars(bars) => bars.height(),
            _ if columns > 1 => 236.0,
            _ => 372.0,
        }
    }

    fn draw(&self, svg: &mut Svg, area: Area) {
        match self {
            Plot::Lines(lines) => lines.draw(svg, area),
            Plot::Histogram(histogram) => histogram.draw(svg, area),
            Plot::Bars(bars) => bars.draw(svg, area),
        }
    }

    /// Its numbers, the first row naming the columns.
    fn table(&self) -> Vec<Vec<String>> {
        match self {
            Plot::Lines(lines) => lines.table(),
            Plot::Histogram(histogram) => histogram.table(),
            Plot::Bars(bars) => bars.table(),
        }
    }
}

fn draw_part(svg: &mut Svg, title: &str, plot: &Plot, area: Area, with_legend: bool) {
    let mut area = area;
    if !title.is_empty() {
        svg.text([area.left, area.top + 14.0], title, 14.5, Anchor::Start, INK);
        area = area.inset(0.0, TITLE, 0.0, 0.0);
    }
    if with_legend {
        let height = legend::draw(svg, &plot.legend(), [area.left, area.top], area.width);
        area = area.inset(0.0, height, 0.0, 0.0);
    }
    plot.draw(svg, area);
}

/// An empty plot that says so.
fn no_data(svg: &mut Svg, area: Area) {
    let middle = area.top + 0.5 * area.height;
    for y in [area.top + 8.0, area.bottom() - 8.0] {
        svg.line([area.left, y], [area.right(), y], Stroke::thin(GRID));
    }
    svg.text([area.left + 0.5 * area.width, middle], "no data", 14.0, Anchor::Middle, MUTED);
}
