//! Counts in bins of equal width.

use super::frame::Frame;
use super::legend::{Entry, Sign};
use super::scale::{Axis, Scale};
use crate::report::encode::fixed;
use crate::report::palette::{AXIS, INK, MUTED, REFERENCE, series};
use crate::report::svg::{Anchor, Area, Stroke, Svg};

/// Between the last bin and the one of all that lies beyond, in bins.
const BREAK: f64 = 1.0;

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
    /// Values that are negative or no numbers; they are not drawn, but told.
    pub skipped: u64,
    /// A dashed line at this value, with its name: the cell size.
    pub line: Option<(f64, String)>,
}

impl Histogram {
    /// Counts values in `bins` bins.
    pub fn of(x: &str, y: &str, width: f64, bins: usize, values: &[f64]) -> Histogram {
        let mut counts = vec![0; bins];
        let (mut overflow, mut skipped) = (0, 0);
        for &v in values {
            if v >= 0.0 {
                // A cast saturates, so that infinity and a width of zero end beyond the bins.
                *counts.get_mut((v / width) as usize).unwrap_or(&mut overflow) += 1;
            } else {
                skipped += 1;
            }
        }
        Histogram { x: x.into(), y: y.into(), width, counts, overflow, skipped, line: None }
    }

    /// The same with a dashed line.
    pub fn line(self, at: f64, name: &str) -> Histogram {
        Histogram { line: Some((at, name.into())), ..self }
    }

    fn total(&self) -> u64 {
        self.counts.iter().sum::<u64>() + self.overflow
    }

    /// Upper edge of the last bin.
    fn end(&self) -> f64 {
        self.width * self.counts.len() as f64
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        let line = self.line.iter();
        let line = line.map(|(_, name)| Entry { name: name.clone(), sign: Sign::Dashed(INK) });
        let beyond = format!("all beyond {}", self.end_text());
        line.chain([Entry { name: beyond, sign: Sign::Block(REFERENCE, 1.0) }]).collect()
    }

    fn end_text(&self) -> String {
        let text = format!("{:.3}", self.end());
        text.trim_end_matches('0').trim_end_matches('.').into()
    }

    pub(super) fn draw(&self, svg: &mut Svg, area: Area) {
        let bins = self.counts.len();
        let drawable = self.total() > 0 && bins > 0 && self.width > 0.0 && self.end().is_finite();
        let x = Axis::new(&self.x).range(0.0, self.end());
        let y = Axis::new(&self.y);
        let most = self.counts.iter().chain([&self.overflow]).max().copied().unwrap_or(0);
        let scales = Scale::new(&x, [0.0]).zip(Scale::new(&y, [0.0, most as f64]));
        let Some((x_scale, y_scale)) = scales.filter(|_| drawable) else {
            return super::no_data(svg, area);
        };
        // Room at the right for the bin beyond.
        let room = (area.width * 0.1).max(58.0);
        let frame = Frame::new(area.inset(0.0, 0.0, room, 0.0), x_scale, y_scale);
        frame.draw(svg, &x, &y);
        let a = frame.area;
        let bin = a.width / bins as f64;
        let gap = if bin > 5.0 { 1.0 } else { 0.0 };
        let height = |count: u64| a.bottom() - frame.y_at(count as f64).unwrap_or(a.bottom());
        let mut bar = |left: f64, width: f64, count: u64, paint| {
            if count > 0 {
                // What is there shall be seen, be it one in a million.
                let height = height(count).max(0.8);
                let top = a.bottom() - height;
                svg.rect(Area { left, top, width, height }, 0.0, paint, 0.88);
            }
        };
        for (i, &count) in self.counts.iter().enumerate() {
            bar(a.left + bin * i as f64 + 0.5 * gap, bin - gap, count, series(0));
        }
        let beyond = [a.right() + (BREAK * bin).max(22.0), a.right() + room];
        bar(beyond[0], beyond[1] - beyond[0], self.overflow, REFERENCE);
        svg.line([beyond[0], a.bottom()], [beyond[1], a.bottom()], Stroke::thin(AXIS));
        let middle = 0.5 * (beyond[0] + beyond[1]) + 2.0;
        let label = format!("> {}", self.end_text());
        svg.text([middle, a.bottom() + 18.0], &label, 12.0, Anchor::Middle, MUTED);
        if let Some(at) = self.line.as_ref().and_then(|l| frame.x_at(l.0))
            && at <= a.right()
        {
            svg.line([at, a.top], [at, a.bottom()], Stroke::dashed(INK));
        }
        self.draw_count(svg, [beyond[1], a.top - 10.0]);
    }

    fn draw_count(&self, svg: &mut Svg, at: [f64; 2]) {
        let mut text = format!("n = {}", fixed(self.total() as f64, 0));
        if self.skipped > 0 {
            text += &format!(", {} no numbers", fixed(self.skipped as f64, 0));
        }
        svg.text(at, &text, 12.0, Anchor::End, MUTED);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_in_one_bin_or_told() {
        let values = [0.0, 0.05, 0.1, 0.29, 0.31, 7.0, f64::INFINITY, f64::NAN, -1.0];
        let h = Histogram::of("error, m", "columns", 0.1, 3, &values);
        assert_eq!((h.counts.as_slice(), h.overflow, h.skipped), (&[2, 1, 1][..], 3, 2));
        let none = Histogram::of("", "", 0.0, 3, &[1.0]);
        assert_eq!((none.total(), none.overflow), (1, 1));
    }
}
