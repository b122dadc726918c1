//! One panel.

use super::{Column, ESTIMATE, GAP, Look, MARGIN, Outline, Panel, SIZE, TITLE, TRUTH, path, rect};
use crate::report::palette::{self, INK, MUTED, PAPER};
use crate::report::svg::{Anchor, Area, Stroke, Svg, width};
use glam::DVec3;
use resvg::tiny_skia::{Paint, Pixmap, Rect, Transform};
use std::collections::BTreeSet;

/// Heights above ground from the palest to the darkest returns, m.
const HEIGHT_SPAN_M: f32 = 2.5;

/// Half the width of a return, units.
const POINT: f64 = 0.8;

/// Colour of the vehicle.
const VEHICLE: &str = "#3a404c";

/// Where metres of the vehicle frame lie on the picture.
pub(super) struct View {
    area: Area,
    per_m: f64,
}

impl View {
    pub fn new(index: usize, side: f64, look: &Look) -> View {
        let left = index as f64 * (side + GAP);
        let area = Area { left, top: TITLE, width: side, height: side };
        View { area, per_m: 0.5 * side / look.half_extent_m }
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let middle =
            [self.area.left + 0.5 * self.area.width, self.area.top + 0.5 * self.area.width];
        [middle[0] - y * self.per_m, middle[1] - x * self.per_m]
    }

    /// The place of something that can be seen.
    fn seen(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y] = self.at(at);
        let a = self.area;
        let inside = (a.left..a.right()).contains(&x) && (a.top..a.bottom()).contains(&y);
        inside.then_some([x, y])
    }

    /// Title, ground and circles.
    pub fn draw_under(&self, svg: &mut Svg, panel: &Panel) {
        let a = self.area;
        svg.text([a.left, a.top - 11.0], &panel.title, 16.0, Anchor::Start, INK);
        svg.raw(&rect(a, "#f8f9fb"));
        svg.clip(a);
        let [x, y] = self.at([0.0, 0.0]);
        for i in 1..=self.circles() {
            let radius = self.circle_m() * i as f64 * self.per_m;
            svg.raw(&format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"none\" \
                 stroke=\"#d5dae2\" stroke-width=\"1\"/>"
            ));
        }
        svg.end_clip();
    }

    /// Between circles: a round number, so that three to seven of them reach the border.
    fn circle_m(&self) -> f64 {
        let reach = 0.5 * self.area.width / self.per_m;
        let power = 10f64.powf((reach / 5.0).log10().floor());
        let digits = [1.0, 2.0, 5.0, 10.0];
        power * digits.into_iter().find(|d| d * power * 5.0 >= reach * 0.8).unwrap_or(10.0)
    }

    fn circles(&self) -> usize {
        (0.5 * self.area.width / self.per_m * std::f64::consts::SQRT_2 / self.circle_m()) as usize
    }

    pub fn draw_points(&self, sheet: &mut Pixmap, scale: f32, points: &[[f32; 3]]) {
        let seen = |p: &[f32; 3]| {
            let place = self.seen([f64::from(p[0]), f64::from(p[1])])?;
            p[2].is_finite().then_some((p[2], place))
        };
        let mut seen: Vec<(f32, [f64; 2])> = points.iter().filter_map(seen).collect();
        // From the ground up, so that what stands there stays visible.
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(ground, _)) = seen.get(seen.len() / 10) else { return };
        // Squares of whole pixels: a hundred thousand smooth discs would take most of a second.
        let mut paint = Paint { anti_alias: false, ..Paint::default() };
        let (margin, half) = (MARGIN as f32, POINT as f32 * scale);
        for (z, [x, y]) in seen {
            let height = ((z - ground) / HEIGHT_SPAN_M).clamp(0.0, 1.0);
            let [r, g, b] = palette::height(f64::from(height));
            paint.set_color_rgba8(r, g, b, 150 + (90.0 * height) as u8);
            let [x, y] = [x, y].map(|v| ((v as f32 + margin) * scale - half).round());
            let side = (2.0 * half).round();
            if let Some(square) = Rect::from_xywh(x, y, side, side) {
                sheet.fill_rect(square, &paint, Transform::identity(), None);
            }
        }
    }

    /// Everything upon the returns.
    pub fn draw_over(&self, svg: &mut Svg, panel: &Panel, look: &Look) {
        svg.clip(self.area);
        for outline in &panel.outlines {
            self.draw_outline(svg, outline);
        }
        for column in &panel.columns {
            self.draw_column(svg, column, look);
        }
        let arrows = one_of_four(&panel.columns, look.cell_m);
        // Thinner where columns are small; truth below, so that an estimate that hits it lies in it.
        let thick = (0.22 * look.cell_m * self.per_m).clamp(0.8, 1.6);
        for column in &arrows {
            if let Some(way) = column.truth {
                self.draw_arrow(svg, column.at, way, 2.4 * thick, TRUTH);
            }
        }
        for column in &arrows {
            if let Some(way) = column.estimate {
                self.draw_arrow(svg, column.at, way, thick, ESTIMATE);
            }
        }
        self.draw_vehicle(svg);
        self.draw_circle_labels(svg);
        self.draw_scale(svg);
        self.draw_forward(svg);
        svg.end_clip();
    }

    fn draw_outline(&self, svg: &mut Svg, outline: &Outline) {
        let [long, wide] = outline.size.map(|v| 0.5 * v);
        let at = |x: f64, y: f64| {
            let p = outline.pose.transform(DVec3::new(x, y, 0.0));
            self.at([p.x, p.y])
        };
        let corners = [at(long, wide), at(long, -wide), at(-long, -wide), at(-long, wide)];
        let ahead = [at(0.0, 0.0), at(long, 0.0)];
        let drawable = corners.iter().chain(&ahead).flatten().all(|v| v.abs() < 1e6);
        if !drawable {
            return;
        }
        let colour = palette::kind(outline.kind).1;
        svg.raw(&format!(
            "<path d=\"{}\" fill=\"{colour}\" fill-opacity=\"0.08\" stroke=\"{colour}\" \
             stroke-width=\"1.6\" stroke-linejoin=\"round\"/>",
            path(&corners) + "Z" + &path(&ahead)
        ));
    }

    fn draw_column(&self, svg: &mut Svg, column: &Column, look: &Look) {
        let Some([x, y]) = self.seen(column.at) else { return };
        // Never too small for its colour to be seen.
        let side = (look.cell_m * self.per_m).max(3.0) - 0.6;
        let area = Area { left: x - 0.5 * side, top: y - 0.5 * side, width: side, height: side };
        let colour = match column.error.filter(|e| e.is_finite()) {
            Some(error) => palette::goodness(error / look.worst),
            None => "#9aa4b2".into(),
        };
        svg.raw(&rect(area, &colour));
    }

    fn draw_arrow(&self, svg: &mut Svg, from: [f64; 2], way: [f64; 2], width: f64, colour: &str) {
        let Some(a) = self.seen(from) else { return };
        let b = self.at([from[0] + way[0], from[1] + way[1]]);
        let long = (b[0] - a[0]).hypot(b[1] - a[1]);
        // Shorter ones would hide the column they belong to.
        if !(1.5..1e5).contains(&long) {
            return;
        }
        let along = [(b[0] - a[0]) / long, (b[1] - a[1]) / long];
        let size = (2.5 + 2.0 * width).min(long);
        let neck = [b[0] - along[0] * size, b[1] - along[1] * size];
        let side = [-along[1] * 0.42 * size, along[0] * 0.42 * size];
        let head =
            [b, [neck[0] + side[0], neck[1] + side[1]], [neck[0] - side[0], neck[1] - side[1]]];
        svg.raw(&format!(
            "<g fill=\"{colour}\" stroke=\"{colour}\"><path d=\"{}\" fill=\"none\" \
             stroke-width=\"{width}\"/><path d=\"{}Z\" stroke=\"none\"/></g>",
            path(&[a, neck]),
            path(&head)
        ));
    }

    /// A car around the origin with its windscreen to the front.
    fn draw_vehicle(&self, svg: &mut Svg) {
        let body = [[2.0, 0.9], [2.5, 0.6], [2.5, -0.6], [2.0, -0.9], [-2.0, -0.9], [-2.0, 0.9]];
        let screen = [[0.5, 0.65], [0.5, -0.65], [1.1, -0.75], [1.1, 0.75]];
        let body = path(&body.map(|p| self.at(p)));
        let screen = path(&screen.map(|p| self.at(p)));
        svg.raw(&format!("<path d=\"{body}Z\" fill=\"{VEHICLE}\"/>"));
        svg.raw(&format!("<path d=\"{screen}Z\" fill=\"#dfe5ee\"/>"));
    }

    fn draw_circle_labels(&self, svg: &mut Svg) {
        for i in 1..=self.circles() {
            let radius = self.circle_m() * i as f64;
            // Along a diagonal: roads leave to the front, back and sides.
            let side = radius * std::f64::consts::FRAC_1_SQRT_2;
            let [x, y] = self.at([-side, side]);
            // Whole or not at all.
            if x < self.area.left + 24.0 || y > self.area.bottom() - 12.0 {
                continue;
            }
            let text = format!("{radius} m");
            let wide = width(&text, 11.5);
            let (left, top) = (x - 0.5 * wide - 2.0, y - 8.0);
            svg.rect(Area { left, top, width: wide + 4.0, height: 16.0 }, 3.0, PAPER, 0.75);
            svg.text([x, y + 4.0], &text, 11.5, Anchor::Middle, MUTED);
        }
    }

    fn draw_scale(&self, svg: &mut Svg) {
        let metres = self.circle_m();
        let (right, y) = (self.area.right() - 18.0, self.area.bottom() - 18.0);
        let left = right - metres * self.per_m;
        let back =
            Area { left: left - 10.0, top: y - 26.0, width: right - left + 20.0, height: 36.0 };
        svg.rect(back, 4.0, PAPER, 0.85);
        let stroke = Stroke { paint: INK, width: 1.6, dashes: "" };
        svg.polyline(&[[left, y - 5.0], [left, y], [right, y], [right, y - 5.0]], stroke);
        let middle = 0.5 * (left + right);
        svg.text([middle, y - 9.0], &format!("{metres} m"), SIZE, Anchor::Middle, INK);
    }

    fn draw_forward(&self, svg: &mut Svg) {
        let (x, y) = (self.area.left + 26.0, self.area.top + 16.0);
        let back = Area { left: x - 18.0, top: y - 8.0, width: 92.0, height: 42.0 };
        svg.rect(back, 4.0, PAPER, 0.85);
        let stroke = Stroke { paint: INK, width: 1.6, dashes: "" };
        svg.line([x, y + 26.0], [x, y + 2.0], stroke);
        svg.polyline(&[[x - 5.0, y + 8.0], [x, y + 1.0], [x + 5.0, y + 8.0]], stroke);
        svg.text([x + 13.0, y + 18.0], "forward", SIZE, Anchor::Start, INK);
    }
}

/// The first column with an arrow of every block of 2 x 2: all of them would hide their columns.
fn one_of_four(columns: &[Column], cell_m: f64) -> Vec<&Column> {
    let mut taken = BTreeSet::new();
    // A cast saturates; what is not finite is not drawn anyway.
    let block = |c: &Column| c.at.map(|v| (v / (2.0 * cell_m)).floor() as i64);
    let arrows = columns.iter().filter(|c| c.truth.is_some() || c.estimate.is_some());
    arrows.filter(|c| taken.insert(block(c))).collect()
}
