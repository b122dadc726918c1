//! Charts: one description, drawn as SVG by plotters (and from that as PNG) and listed as CSV.

mod axis;
mod bars;
mod colours;
mod histogram;
mod legend;
mod lines;

pub use axis::Axis;
pub use bars::{Bar, BarSeries, Bars};
pub use histogram::Histogram;
pub use lines::{Guide, Lines, Mark, Series, Style};

use super::encode::{csv, xml};
use colours::{AXIS, GRID, INK, MUTED};
use legend::Entry;
use plotters::backend::SVGBackend;
use plotters::chart::MeshStyle;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::Text;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, RGBColor, TRANSPARENT, TextStyle};

/// Width of every chart, units.
const WIDTH: f64 = 736.0;
/// Height of a plot beside another and of a single one, units.
const HEIGHTS: [f64; 2] = [240.0, 372.0];
/// Height of the title of a part, units.
const TITLE: f64 = 24.0;
/// Height of letters, units.
const LETTER: f64 = 12.5;
/// plotters draws in whole pixels: this many make a unit, for curves to be smooth.
const FINE: f64 = 16.0;

type Sheet<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;
/// Whether there was anything to draw.
type Outcome = Result<bool, DrawingAreaErrorKind<std::io::Error>>;

/// Converts units to plotters' pixels.
fn px(units: f64) -> i32 {
    (units * FINE).round() as i32
}

/// Coloured letters that lie on this side of their anchor, vertically centred on it.
fn font(size: f64, colour: RGBColor, side: HPos) -> TextStyle<'static> {
    // plotters takes 1.24 of the size that it writes.
    let font = ("sans-serif", size * FINE * 1.24).into_font();
    font.color(&colour).pos(Pos::new(side, VPos::Center))
}

/// Gives grid, axes and labels of every plot the same look.
fn styled<X, Y>(mesh: &mut MeshStyle<X, Y, SVGBackend>)
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let thin = px(1.0) as u32;
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(thin))
        .axis_style(AXIS.stroke_width(thin))
        .set_all_tick_mark_size(px(4.0))
        .label_style(font(LETTER, MUTED, HPos::Center))
        .x_labels(6)
        .y_labels(6);
}

/// Approximate width of a text, units; rather too wide than too narrow.
fn width(text: &str, size: f64) -> f64 {
    0.56 * size * text.chars().count() as f64
}

/// A figure of one plot, or of several small ones for comparison.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Name of its files, unlike any other's in the report: letters, digits, `-` and `_`.
    pub id: String,
    /// What the chart shows, in which units, from how many samples.
    pub caption: String,
    parts: Vec<(String, Plot)>,
}

/// The content of a chart.
#[derive(Clone, Debug)]
pub enum Plot {
    /// Curves or dots over two axes.
    Lines(Lines),
    /// Counts in bins.
    Histogram(Histogram),
    /// Horizontal bars for comparison.
    Bars(Bars),
}

impl Chart {
    /// A single plot.
    pub fn new(id: &str, caption: &str, plot: Plot) -> Chart {
        Chart::small_multiples(id, caption, vec![(String::new(), plot)])
    }

    /// Small plots two by two, each under its title and with its own axes.
    pub fn small_multiples(id: &str, caption: &str, parts: Vec<(String, Plot)>) -> Chart {
        Chart { id: id.into(), caption: caption.into(), parts }
    }

    /// The drawing and its width and height, units.
    pub(super) fn svg(&self) -> (String, [f64; 2]) {
        let columns = if self.parts.len() > 1 { 2 } else { 1 };
        let wide = WIDTH / columns as f64;
        let shared = self.shared_legend();
        let top = legend::height(shared.as_deref().unwrap_or_default(), WIDTH);
        let height_of = |(title, plot): &(String, Plot)| {
            let own = if shared.is_some() { 0.0 } else { legend::height(&plot.legend(), wide) };
            plot.height(columns) + own + if title.is_empty() { 0.0 } else { TITLE }
        };
        let rows = self.parts.chunks(columns);
        let heights: Vec<f64> =
            rows.map(|row| row.iter().map(height_of).fold(0.0, f64::max)).collect();
        let size = [WIDTH, (top + heights.iter().sum::<f64>()).max(40.0)];
        let mut svg = String::new();
        let sheet = SVGBackend::with_string(&mut svg, (px(size[0]) as u32, px(size[1]) as u32))
            .into_drawing_area();
        let draw = || -> Drawn {
            let (head, body) = sheet.split_vertically(px(top));
            legend::draw(&head, shared.as_deref().unwrap_or_default(), WIDTH)?;
            let ends = heights.iter().scan(0.0, |sum, h| {
                *sum += h;
                Some(px(*sum))
            });
            let below: Vec<i32> = ends.take(heights.len().saturating_sub(1)).collect();
            let beside: Vec<i32> = (1..columns).map(|_| px(wide)).collect();
            for ((title, plot), cell) in
                self.parts.iter().zip(body.split_by_breakpoints(beside, below))
            {
                draw_part(&cell, title, plot, shared.is_none(), wide)?;
            }
            sheet.present()
        };
        draw().expect("drawing into memory");
        drop(sheet);
        (labelled(&svg, size, &self.caption), size)
    }

    /// The legend of all parts if they share one.
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
            // Consecutive parts of one kind share a header.
            if table[0] != header {
                header.clone_from(&table[0]);
                rows.push(header.clone());
            }
            rows.extend(table.drain(1..));
        }
        csv(&rows)
    }
}

/// The drawing in units, with a label for those who cannot see it.
fn labelled(svg: &str, [w, h]: [f64; 2], label: &str) -> String {
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    let [fine_w, fine_h] = [w, h].map(px);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{}\" width=\"{w}\" \
         height=\"{h}\" viewBox=\"0 0 {fine_w} {fine_h}\">{body}",
        xml(label)
    )
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
            _ => HEIGHTS[usize::from(columns == 1)],
        }
    }

    fn draw(&self, sheet: &Sheet) -> Outcome {
        match self {
            Plot::Lines(lines) => lines.draw(sheet),
            Plot::Histogram(histogram) => histogram.draw(sheet),
            Plot::Bars(bars) => bars.draw(sheet),
        }
    }

    /// Its numbers; the first row names the columns.
    fn table(&self) -> Vec<Vec<String>> {
        match self {
            Plot::Lines(lines) => lines.table(),
            Plot::Histogram(histogram) => histogram.table(),
            Plot::Bars(bars) => bars.table(),
        }
    }
}

fn draw_part(cell: &Sheet, title: &str, plot: &Plot, with_legend: bool, wide: f64) -> Drawn {
    let mut sheet = cell.clone();
    if !title.is_empty() {
        let (head, body) = sheet.split_vertically(px(TITLE));
        let style = font(14.5, INK, HPos::Left);
        head.draw(&Text::new(title.to_string(), (0, px(0.5 * TITLE)), style))?;
        sheet = body;
    }
    if with_legend {
        let entries = plot.legend();
        let (head, body) = sheet.split_vertically(px(legend::height(&entries, wide)));
        legend::draw(&head, &entries, wide)?;
        sheet = body;
    }
    if !plot.draw(&sheet)? {
        let (w, h) = sheet.dim_in_pixel();
        let style = font(14.0, MUTED, HPos::Center);
        sheet.draw(&Text::new("no data", (w as i32 / 2, h as i32 / 2), style))?;
    }
    Ok(())
}
