//! A map of the ground from a file: an ESRI ASCII grid in the frame of the poses.
//!
//! Lines of a key and a number (`ncols`, `nrows`, `xllcorner`, `yllcorner`, `cellsize` and,
//! optionally, `NODATA_value`; m), then `nrows` lines of `ncols` heights (m), starting with the
//! largest y.

use std::path::Path;

use raywake_objects::front_end::GroundMap;

use raywake_io::Error;
use raywake_io::source::{text, whole};

/// Heights of the ground; owns its memory.
#[derive(Debug)]
pub struct Ground {
    corner: [f64; 2],
    cell_m: f64,
    columns: usize,
    heights: Vec<f32>,
}

impl Ground {
    /// Reads a file; fails if it is not such a grid.
    pub fn read(path: &Path) -> Result<Ground, Error> {
        parse(path, &whole::read_text(path)?)
    }

    /// The map in the form the front end takes.
    pub fn map(&self) -> GroundMap<'_> {
        GroundMap {
            corner: self.corner,
            cell_m: self.cell_m,
            columns: self.columns,
            heights: &self.heights,
        }
    }
}

fn parse(path: &Path, content: &str) -> Result<Ground, Error> {
    let whole = |what: String| Error::input(path, "", what);
    let mut lines = text::lines(content).peekable();
    let mut header = Vec::new();
    let starts_with_key = |line: &(usize, &str)| {
        line.1.starts_with(|c: char| c.is_ascii_alphabetic()) && line.1.parse::<f64>().is_err()
    };
    while let Some((number, line)) = lines.next_if(starts_with_key) {
        let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let [value] = text::exactly::<1>(path, number, value)?;
        header.push((key.to_ascii_lowercase(), value));
    }
    let find = |key: &str| header.iter().find(|(k, _)| k == key).map(|(_, v)| *v);
    let needed = |key: &str| {
        let value = find(key).filter(|v| v.is_finite());
        value.ok_or_else(|| whole(format!("`{key}` missing or not finite: not an ESRI ASCII grid")))
    };
    let [columns, rows] = [needed("ncols")?, needed("nrows")?];
    let corner = [needed("xllcorner")?, needed("yllcorner")?];
    let cell_m = needed("cellsize")?;
    if !(columns >= 1.0 && rows >= 1.0 && cell_m > 0.0) {
        return Err(whole("ncols and nrows must be at least 1 and cellsize above 0".into()));
    }
    let (columns, rows) = (columns as usize, rows as usize);
    let nothing = find("nodata_value");
    let (mut heights, mut count) = (Vec::new(), 0);
    for (number, line) in lines {
        let row = text::numbers(path, number, line)?;
        if row.len() != columns {
            let what = format!("expected {columns} heights, found {}", row.len());
            return Err(Error::input(path, format!("line {number}"), what));
        }
        let height = |z: f64| if Some(z) == nothing { f32::NAN } else { z as f32 };
        heights.extend(row.into_iter().map(height));
        count += 1;
    }
    if count != rows {
        return Err(whole(format!("expected {rows} rows of heights, found {count}")));
    }
    // The first row is the northernmost.
    for row in 0..rows / 2 {
        let (front, back) = heights.split_at_mut((rows - 1 - row) * columns);
        front[row * columns..][..columns].swap_with_slice(&mut back[..columns]);
    }
    Ok(Ground { corner, cell_m, columns, heights })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: &str = "\
ncols 3
nrows 2
xllcorner -1.5
yllcorner 4
cellsize 2
NODATA_value -9999
0.5 0.6 -9999
1 nan 3
";

    #[test]
    fn a_grid_is_read_from_the_north() {
        let ground = parse(Path::new("g.asc"), GRID).unwrap();
        let map = ground.map();
        let heights = [[-1.0, 4.5], [4.0, 5.9], [-1.0, 6.1], [1.0, 7.0]];
        let found = heights.map(|[x, y]| map.height(x, y));
        assert_eq!(found, [Some(1.0), Some(3.0), Some(0.5), Some(0.6)]);
        for [x, y] in [[4.0, 7.0], [1.0, 5.0], [-1.6, 5.0], [0.0, 8.1], [0.0, 3.9], [4.6, 5.0]] {
            assert_eq!(map.height(x, y), None, "{x}, {y}");
        }
    }

    #[test]
    fn damaged_grids() {
        crate::damaged::check(GRID, 5000, |text| match parse(Path::new("g.asc"), text) {
            Ok(ground) => {
                let map = ground.map();
                assert_eq!(map.heights.len() % map.columns, 0);
                // Anywhere, whatever the numbers.
                [-1e300, -1.0, 0.0, 4.5, 1e300].iter().for_each(|x| _ = map.height(*x, 5.0));
                true
            }
            Err(_) => false,
        });
    }

    #[test]
    fn invalid_grids() {
        let wrong = [
            ("cellsize 2", "", "`cellsize`"),
            ("cellsize 2", "cellsize -2", "above 0"),
            ("ncols 3", "ncols 4", "line 7: expected 4 heights, found 3"),
            ("nrows 2", "nrows 3", "3 rows"),
            ("nrows 2", "nrows two", "line 2: `two` is not a number"),
            ("1 nan 3", "1 x 3", "line 8: `x` is not a number"),
        ];
        for (from, to, what) in wrong {
            let e = parse(Path::new("g.asc"), &GRID.replace(from, to)).unwrap_err().to_string();
            assert!(e.contains("g.asc") && e.contains(what), "{e}");
        }
        assert!(parse(Path::new("g.asc"), "").is_err());
    }
}
