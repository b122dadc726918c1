//! Counts in bins of equal width.

use super::axis::{Axis, linear_label};
use super::colours::{INK, MUTED, REFERENCE, series};
use super::legend::{Entry, Sign};
use super::{LETTER, Outcome, Sheet, font, px, styled};
use crate::report::encode::fixed;
use plotters::chart::ChartBuilder;
use plotters::element::{Rectangle, Text};
use plotters::series::DashedLineSeries;
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

/// The bin of everything beyond the others, as fractions of their total width.
const BEYOND: [f64; 2] = [1.04, 1.12];

/// Counts in bins of equal width from zero, and of all beyond them.
#[derive(Clone, Debug)]
pub struct Histogram {
    /// Quantity and unit of what is counted.
    pub x: String,
    /// What is counted, as in "columns".
    pub y: String,
    /// Width of a bin.
    pub width: f64,
    /// From zero up, each with its lower edge.
    pub counts: Vec<u64>,
    /// Values beyond the bins.
    pub overflow: u64,
    /// A dashed line at this value, with its name, such as the cell size.
    pub line: Option<(f64, String)>,
}

impl Histogram {
    /// Upper edge of the last bin.
    fn end(&self) -> f64 {
        self.width * self.counts.len() as f64
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        let line = self.line.iter();
        let line = line.map(|(_, name)| Entry { name: name.clone(), sign: Sign::Dashed(INK) });
        let name = format!("all beyond {}", self.end() as f32);
        line.chain([Entry { name, sign: Sign::Block(REFERENCE) }]).collect()
    }

    pub(super) fn draw(&self, sheet: &Sheet) -> Outcome {
        let total = self.counts.iter().sum::<u64>() + self.overflow;
        let most = self.counts.iter().chain([&self.overflow]).max().copied().unwrap_or(0);
        let x = Axis::new("").range(0.0, BEYOND[1] * self.end()).ends([0.0]);
        let (Some(x), true) = (x, total > 0) else { return Ok(false) };
        let y = 0.0..1.05 * most as f64;
        let mut plane = ChartBuilder::on(sheet)
            .margin_top(px(22.0))
            .margin_right(px(22.0))
            .x_label_area_size(px(42.0))
            .y_label_area_size(px(64.0))
            .build_cartesian_2d(x, y.clone())?;
        let label = linear_label(0.0..self.end());
        let x_label = |v: &f64| if *v > self.end() { String::new() } else { label(v) };
        let y_label = linear_label(y.clone());
        let mut mesh = plane.configure_mesh();
        styled(&mut mesh);
        mesh.disable_x_mesh().x_label_formatter(&x_label).y_label_formatter(&y_label);
        mesh.x_desc(&self.x).y_desc(&self.y).draw()?;
        let bins = (0..).zip(&self.counts).map(|(i, count)| {
            let [from, to] = [i, i + 1].map(|i| self.width * f64::from(i));
            Rectangle::new([(from, 0.0), (to, *count as f64)], series(0).mix(0.88).filled())
        });
        plane.draw_series(bins)?;
        let [from, to] = BEYOND.map(|part| part * self.end());
        let beyond = [(from, 0.0), (to, self.overflow as f64)];
        plane.draw_series([Rectangle::new(beyond, REFERENCE.filled())])?;
        if let Some((at, _)) = self.line.as_ref().filter(|l| (0.0..self.end()).contains(&l.0)) {
            let style = INK.stroke_width(px(1.3) as u32);
            let ends = [(*at, 0.0), (*at, y.end)];
            plane.draw_series(DashedLineSeries::new(
                ends,
                px(5.0) as u32,
                px(4.0) as u32,
                style,
            ))?;
        }
        let corner = (sheet.dim_in_pixel().0 as i32 - px(22.0), px(10.0));
        let count = format!("n = {}", fixed(total as f64, 0));
        sheet.draw(&Text::new(count, corner, font(LETTER, MUTED, HPos::Right)))?;
        Ok(true)
    }

    pub(super) fn table(&self) -> Vec<Vec<String>> {
        let header = [format!("{} from", self.x), format!("{} to", self.x), self.y.clone()];
        let edge = |i: usize| (self.width * i as f64).to_string();
        let row = |(i, count): (usize, &u64)| vec![edge(i), edge(i + 1), count.to_string()];
        let mut rows = vec![header.to_vec()];
        rows.extend(self.counts.iter().enumerate().map(row));
        rows.push(vec![edge(self.counts.len()), "inf".into(), self.overflow.to_string()]);
        rows
    }
}
