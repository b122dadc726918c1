//! Colours, safe for colour-blind readers (Okabe and Ito) and apart in print.

use crate::labels::Kind;

/// A colour on paper, and the class by which a style sheet may replace it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Paint {
    /// Class of an SVG element.
    pub class: &'static str,
    /// `#rrggbb`.
    pub light: &'static str,
}

const fn paint(class: &'static str, light: &'static str) -> Paint {
    Paint { class, light }
}

/// Text.
pub(super) const INK: Paint = paint("ink", "#1f2430");
/// Text that steps back, and reference values.
pub(super) const MUTED: Paint = paint("muted", "#667085");
/// The page.
pub(super) const PAPER: Paint = paint("paper", "#ffffff");

/// Of a kind of object, with its name.
pub(super) fn kind(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Car => ("car", "#0072b2"),
        Kind::Van => ("van", "#3f9bd0"),
        Kind::Truck => ("truck", "#7a6a53"),
        Kind::Bus => ("bus", "#a37f36"),
        Kind::Tram => ("tram", "#4b4f58"),
        Kind::Motorcycle => ("motorcycle", "#b5609a"),
        Kind::Cyclist => ("cyclist", "#d55e00"),
        Kind::Pedestrian => ("pedestrian", "#a3308a"),
        Kind::Other => ("other", "#8792a2"),
    }
}

/// From good (0) to bad (1): green, yellow, orange, dark red; lightness tells the ends apart too.
pub(super) fn goodness(t: f64) -> String {
    blend(
        &[[0.0, 158.0, 115.0], [240.0, 214.0, 60.0], [226.0, 106.0, 20.0], [140.0, 16.0, 40.0]],
        t,
    )
}

/// Of returns from the ground (0) up (1), pale to slate.
pub(super) fn height(t: f64) -> [u8; 3] {
    mix(&[[208.0, 216.0, 226.0], [156.0, 172.0, 192.0], [98.0, 116.0, 142.0]], t)
}

/// Of a time from first (0) to last (1): blue over green to yellow, ever lighter.
pub(super) fn time(t: f64) -> [u8; 3] {
    mix(&[[53.0, 42.0, 135.0], [15.0, 118.0, 200.0], [55.0, 184.0, 157.0], [250.0, 220.0, 30.0]], t)
}

fn blend(stops: &[[f64; 3]], t: f64) -> String {
    let [r, g, b] = mix(stops, t);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn mix(stops: &[[f64; 3]], t: f64) -> [u8; 3] {
    let place = t.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let i = (place as usize).min(stops.len() - 2);
    let part = place - i as f64;
    [0, 1, 2].map(|c| (stops[i][c] + (stops[i + 1][c] - stops[i][c]) * part).round() as u8)
}
