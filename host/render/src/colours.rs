//! Colours that colour-blind readers can distinguish: hues after Okabe and Ito ("Color universal
//! design", 2008), and ramps whose lightness changes from end to end.

/// Red, green and blue, 0 to 255, in sRGB.
pub type Colour = [u8; 3];

/// The page.
pub const PAPER: Colour = [255, 255, 255];
/// Background of a panel.
pub const GROUND: Colour = [248, 249, 251];
/// Text.
pub const INK: Colour = [31, 36, 48];
/// Secondary text.
pub const MUTED: Colour = [102, 112, 133];
/// Range rings.
pub const RING: Colour = [208, 214, 223];
/// Border of the window in which motion is estimated, and the shade outside it.
pub const BORDER: Colour = [126, 136, 152];
/// Static objects.
pub const STATIC: Colour = [212, 221, 233];
/// Observed free space.
pub const FREE: Colour = [226, 236, 240];
/// The own vehicle.
pub const VEHICLE: Colour = [58, 64, 76];

/// Returns by height, from the ground up.
pub const HEIGHTS: &[Colour] = &[[208, 216, 226], [156, 172, 192], [98, 116, 142]];
/// Speeds, from slow to fast.
pub const SPEEDS: &[Colour] = &[[240, 158, 30], [222, 84, 32], [176, 22, 74], [82, 12, 98]];
/// Heights where they are the subject, as in a map, from low to high.
pub const ELEVATIONS: &[Colour] =
    &[[154, 176, 196], [62, 148, 168], [38, 96, 142], [64, 26, 98], [30, 4, 36]];

/// Clamps to 0 to 1; NaN counts as 0.
pub fn clamped(t: f32) -> f32 {
    if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) }
}

/// Returns the colour at `t` (0 to 1, clamped; NaN counts as 0) of a ramp with evenly spaced stops.
pub fn ramp(stops: &[Colour], t: f32) -> Colour {
    let Some(last) = stops.len().checked_sub(1) else { return INK };
    let place = clamped(t) * last as f32;
    let i = (place as usize).min(last.saturating_sub(1));
    let (from, to, part) = (stops[i], stops[(i + 1).min(last)], place - i as f32);
    [0, 1, 2].map(|c| {
        let (a, b) = (f32::from(from[c]), f32::from(to[c]));
        (a + (b - a) * part + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance, 0 to 1 (WCAG 2.1).
    fn luminance(colour: Colour) -> f64 {
        let linear = |v: u8| (f64::from(v) / 255.0).powf(2.2);
        0.2126 * linear(colour[0]) + 0.7152 * linear(colour[1]) + 0.0722 * linear(colour[2])
    }

    #[test]
    fn ramps_darken_from_end_to_end() {
        for stops in [HEIGHTS, SPEEDS, ELEVATIONS] {
            let steps = (0..=20).map(|i| luminance(ramp(stops, i as f32 / 20.0)));
            let steps: Vec<f64> = steps.collect();
            assert!(steps.windows(2).all(|w| w[1] < w[0]), "{steps:?}");
        }
    }

    #[test]
    fn the_ends_of_a_ramp_are_its_stops() {
        assert_eq!(ramp(SPEEDS, 0.0), SPEEDS[0]);
        assert_eq!(ramp(SPEEDS, 1.0), SPEEDS[3]);
        assert_eq!(ramp(SPEEDS, f32::INFINITY), SPEEDS[3]);
        assert_eq!(ramp(SPEEDS, f32::NAN), SPEEDS[0]);
        assert_eq!(ramp(&[PAPER], 0.7), PAPER);
    }
}
