//! Digits as shipped with scikit-learn: one per line, the pixels from 0 to 16, then the digit.

use super::{CLASSES, Digits, bytes};
use raywake_io::Error;
use std::path::Path;

/// Value of the brightest pixel.
const TOP: f32 = 16.0;

/// All digits of a file.
pub fn read(path: &Path) -> Result<Digits, Error> {
    let bytes = bytes(path)?;
    let mut lines = csv::ReaderBuilder::new().has_headers(false).from_reader(bytes.as_slice());
    let mut digits = Digits::default();
    for line in lines.records() {
        let line = line.map_err(|e| Error::input(path, "", e.to_string()))?;
        let place = || format!("line {}", line.position().map_or(0, csv::Position::line));
        let number = |text: &str| text.trim().parse::<f32>().ok();
        let numbers: Option<Vec<f32>> = line.iter().map(number).collect();
        let Some((label, pixels)) = numbers.as_deref().and_then(<[f32]>::split_last) else {
            return Err(Error::input(path, place(), "contains something other than numbers"));
        };
        if !(0..CLASSES).any(|digit| digit as f32 == *label) {
            return Err(Error::input(
                path,
                place(),
                format!("ends in {label}, which is not a digit"),
            ));
        }
        if pixels.is_empty() || pixels.iter().any(|p| !(0.0..=TOP).contains(p)) {
            return Err(Error::input(path, place(), format!("a pixel outside 0 to {TOP}")));
        }
        digits.pixels = pixels.len();
        digits.values.extend(pixels.iter().map(|p| p / TOP));
        digits.labels.push(*label as u8);
    }
    Ok(digits)
}
