//! Marks upon curves, their words where they cover least.

use super::frame::Frame;
use super::lines::Series;
use crate::report::palette::{AXIS, INK, MARK, PAPER};
use crate::report::svg::{Anchor, Area, Stroke, Svg, width};

const SIZE: f64 = 12.5;

/// Draws the marks of all series that lie between the axes.
pub(super) fn draw(svg: &mut Svg, frame: &Frame, series: &[Series]) {
    let marks: Vec<([f64; 2], &str)> = series
        .iter()
        .flat_map(|s| &s.marks)
        .filter_map(|m| Some((frame.at(m.at)?, m.label.as_str())))
        .filter(|(at, _)| holds(frame.area, *at))
        .collect();
    let mut obstacles: Vec<[f64; 2]> = series.iter().flat_map(|s| trail(frame, s)).collect();
    obstacles.extend(marks.iter().map(|m| m.0));
    let mut taken: Vec<Area> = Vec::new();
    for &(at, label) in &marks {
        svg.disc(at, 6.0, PAPER, 1.0);
        svg.disc(at, 4.6, MARK, 1.0);
        let cost = |a: &Area| {
            let covered = obstacles.iter().filter(|&&p| holds(*a, p)).count();
            let clashes = taken.iter().filter(|t| overlap(a, t)).count();
            let outside = [[a.left, a.top], [a.right(), a.bottom()]];
            let outside = outside.iter().filter(|&&p| !holds(frame.area, p)).count();
            covered + 100 * clashes + 1000 * outside
        };
        let Some(best) = candidates(at, width(label, SIZE)).into_iter().min_by_key(cost) else {
            continue;
        };
        draw_leader(svg, at, &best);
        svg.text([best.left, best.bottom() - 4.0], label, SIZE, Anchor::Start, INK);
        taken.push(best);
    }
}

/// A thin line from a mark to its word, where they are not beside each other.
fn draw_leader(svg: &mut Svg, at: [f64; 2], word: &Area) {
    let near = [
        at[0].clamp(word.left - 3.0, word.right() + 3.0),
        at[1].clamp(word.top + 2.0, word.bottom() - 2.0),
    ];
    let way = [near[0] - at[0], near[1] - at[1]];
    let long = way[0].hypot(way[1]);
    if long > 14.0 {
        let start = [0, 1].map(|c| at[c] + way[c] * 7.0 / long);
        svg.line(start, near, Stroke::thin(AXIS));
    }
}

/// Areas for a word of this width around a place, the preferred first.
fn candidates([x, y]: [f64; 2], width: f64) -> Vec<Area> {
    let height = SIZE + 4.0;
    let mut areas = Vec::new();
    for far in [11.0, 24.0, 40.0] {
        let up = y - far - height + 4.0;
        let down = y + far - 4.0;
        let level = y - 0.5 * height;
        for (left, top) in [
            (x - far - width, level),
            (x + far, level),
            (x - 0.7 * far - width, down),
            (x + 0.7 * far, up),
            (x + 0.7 * far, down),
            (x - 0.7 * far - width, up),
            (x - 0.5 * width, down),
            (x - 0.5 * width, up),
        ] {
            areas.push(Area { left, top, width, height });
        }
    }
    areas
}

/// Places along a curve, close enough that no word fits between two.
fn trail(frame: &Frame, s: &Series) -> Vec<[f64; 2]> {
    let places: Vec<[f64; 2]> = s.points.iter().filter_map(|&p| frame.at(p)).collect();
    let between = |w: &[[f64; 2]]| {
        let steps = ((w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]) / 5.0).clamp(1.0, 400.0) as usize;
        let (a, b) = (w[0], w[1]);
        (0..steps).map(move |i| {
            let t = i as f64 / steps as f64;
            [0, 1].map(|c| a[c] + (b[c] - a[c]) * t)
        })
    };
    let last = places.last().copied();
    places.windows(2).flat_map(between).chain(last).collect()
}

fn holds(a: Area, [x, y]: [f64; 2]) -> bool {
    (a.left - 1.0..=a.right() + 1.0).contains(&x) && (a.top - 1.0..=a.bottom() + 1.0).contains(&y)
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom()
}
