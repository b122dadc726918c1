//! Colours of charts, safe for colour-blind readers (Okabe and Ito) and distinguishable in print.
//! In dark mode the page's style sheet replaces them, selecting on these values.

use plotters::style::RGBColor;

pub(super) const INK: RGBColor = rgb(0x1f2430);
/// De-emphasised text, and reference values.
pub(super) const MUTED: RGBColor = rgb(0x667085);
pub(super) const GRID: RGBColor = rgb(0xe4e7ec);
/// Lines at zero.
pub(super) const AXIS: RGBColor = rgb(0x98a2b3);
/// Bars of reference values.
pub(super) const REFERENCE: RGBColor = rgb(0xc3cad5);
/// Marks on curves.
pub(super) const MARK: RGBColor = rgb(0xc0182b);

const SERIES: [u32; 10] = [
    0x0072b2, 0xd55e00, 0x009e73, 0xb5609a, 0xe69f00, 0x56b4e9, 0x7a6a53, 0x3d3d8f, 0xa3b18a,
    0x9b2226,
];

const ORDERED: [u32; 7] = [0xa9d4ea, 0x7cbbdf, 0x4f9fd0, 0x2f81bb, 0x1b639f, 0x12467b, 0x0a2a54];

const fn rgb(v: u32) -> RGBColor {
    RGBColor((v >> 16) as u8, (v >> 8) as u8, v as u8)
}

/// Colour of the `i`-th of several series; repeats after ten.
pub(super) fn series(i: usize) -> RGBColor {
    rgb(SERIES[i % SERIES.len()])
}

/// Colour of the `i`-th of `n` ordered series, pale to dark.
pub(super) fn ordered(i: usize, n: usize) -> RGBColor {
    let last = ORDERED.len() - 1;
    rgb(ORDERED[if n > 1 { (i * last / (n - 1)).min(last) } else { last }])
}
