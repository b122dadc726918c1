//! A writer of SVG: the one drawing source of files, pages and rasters.
//!
//! Colours are written out for whoever knows no style sheet, with a class for a page that has one.

use super::encode::xml;
use super::palette::Paint;
use std::fmt::Write;

/// Fonts in a browser; the raster has one font whatever is asked for.
const FONTS: &str = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";

/// Which end of a text its position means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
}

/// A stroke of this colour, width (units) and, where not empty, dashes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke {
    pub paint: Paint,
    pub width: f64,
    pub dashes: &'static str,
}

/// A drawing under way: x to the right, y down, about a pixel per unit.
pub(super) struct Svg {
    size: [f64; 2],
    margin: f64,
    body: String,
}

/// An area of a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Area {
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

impl Svg {
    /// A drawing of this size and the margin around it.
    pub fn new(width: f64, height: f64, margin: f64) -> Svg {
        Svg { size: [width, height], margin, body: String::new() }
    }

    /// Width and height with the margin.
    pub fn size(&self) -> [f64; 2] {
        self.size.map(|v| v + 2.0 * self.margin)
    }

    /// The document; `label` says to those who cannot see it what it is.
    pub fn finish(self, label: &str) -> String {
        let ([w, h], from) = (self.size(), -self.margin);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{}\" \
             width=\"{w}\" height=\"{h}\" viewBox=\"{from} {from} {w} {h}\" \
             font-family=\"{FONTS}\">\
             {}</svg>\n",
            xml(label),
            self.body
        )
    }

    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.body.write_fmt(text);
        self.body.push('\n');
    }

    /// What is drawn until [`Svg::end_clip`] shows only within the area; coordinates stay.
    pub fn clip(&mut self, a: Area) {
        let Area { left: x, top: y, width: w, height: h } = a;
        self.push(format_args!(
            "<svg x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" \
             viewBox=\"{x:.2} {y:.2} {w:.2} {h:.2}\" overflow=\"hidden\">"
        ));
    }

    pub fn end_clip(&mut self) {
        self.push(format_args!("</svg>"));
    }

    pub fn rect(&mut self, a: Area, radius: f64, fill: Paint, opacity: f64) {
        self.push(format_args!(
            "<rect class=\"f-{}\" x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\" \
             rx=\"{radius}\" fill=\"{}\" fill-opacity=\"{opacity}\"/>",
            fill.class, a.left, a.top, a.width, a.height, fill.light
        ));
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], stroke: Stroke) {
        self.push(format_args!(
            "<line {} x1=\"{x1:.2}\" y1=\"{y1:.2}\" x2=\"{x2:.2}\" y2=\"{y2:.2}\"/>",
            stroke_attributes(stroke)
        ));
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        let places: Vec<String> = points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        self.push(format_args!(
            "<polyline {} fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\" \
             points=\"{}\"/>",
            stroke_attributes(stroke),
            places.join(" ")
        ));
    }

    /// Text on the baseline `y`, `size` units high.
    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, size: f64, anchor: Anchor, paint: Paint) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
        };
        self.push(format_args!(
            "<text class=\"f-{}\" x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size}\" \
             text-anchor=\"{anchor}\" fill=\"{}\">{}</text>",
            paint.class,
            paint.light,
            xml(text)
        ));
    }

    /// An element written out by the caller.
    pub fn raw(&mut self, element: &str) {
        self.push(format_args!("{element}"));
    }
}

fn stroke_attributes(s: Stroke) -> String {
    let dashes = match s.dashes {
        "" => String::new(),
        dashes => format!(" stroke-dasharray=\"{dashes}\""),
    };
    let Paint { class, light } = s.paint;
    format!("class=\"l-{class}\" stroke=\"{light}\" stroke-width=\"{}\"{dashes}", s.width)
}

/// About how wide a text is, units; rather more than less.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let of = |c: char| match c {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '|' | '\'' | ' ' | '(' | ')' => 0.32,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.88,
        c if c.is_ascii_uppercase() => 0.68,
        c if c.is_ascii() => 0.57,
        _ => 0.75,
    };
    text.chars().map(of).sum::<f64>() * size
}
