//! The height of the ground in an Argoverse 2 map, and which returns belong to it.
//!
//! `map/*_ground_height_surface____*.npy` holds heights (m, city frame; NaN where unknown) on a
//! lattice; `map/*img_Sim2_city.json` maps a place in the city to (column, row) as `s (R p + t)`,
//! rounded, halves to even.

use glam::{DMat2, DVec2, DVec3};
use raywake_io::Error;
use raywake_io::source::npy::{self, Array};
use serde::Deserialize;
use std::fs;
use std::path::{Path, PathBuf};

/// Height above the map's ground up to which a return belongs to it, m. Everything below does, too.
const WITHIN_M: f64 = 0.4;

/// Heights of the ground.
pub(super) struct Ground {
    heights: Array,
    rotation: DMat2,
    translation: DVec2,
    scale: f64,
}

/// The similarity as stored in the file.
#[derive(Deserialize)]
struct Sim2 {
    #[serde(rename = "R")]
    rotation: [f64; 4],
    #[serde(rename = "t")]
    translation: [f64; 2],
    #[serde(rename = "s")]
    scale: f64,
}

impl Ground {
    /// Reads the map in the folder of a log.
    pub fn read(log: &Path) -> Result<Ground, Error> {
        let map = log.join("map");
        let is_heights = |n: &str| n.contains("_ground_height_surface____") && n.ends_with(".npy");
        let heights = npy::read(&only(&map, "a height raster", is_heights)?)?;
        let path = only(&map, "a Sim2", |n| n.ends_with("img_Sim2_city.json"))?;
        let text = fs::read_to_string(&path).map_err(Error::reading(&path))?;
        let sim: Sim2 =
            serde_json::from_str(&text).map_err(|e| Error::input(&path, "", e.to_string()))?;
        let numbers = [&sim.rotation[..], &sim.translation, &[sim.scale]].concat();
        if numbers.iter().any(|v| !v.is_finite()) || sim.scale <= 0.0 {
            return Err(Error::input(&path, "", "the similarity has an invalid number"));
        }
        let [a, b, c, d] = sim.rotation;
        let rotation = DMat2::from_cols(DVec2::new(a, c), DVec2::new(b, d));
        let translation = DVec2::from_array(sim.translation);
        Ok(Ground { heights, rotation, translation, scale: sim.scale })
    }

    /// Whether a return at `p` (city frame, m) belongs to the ground; never where the map has no
    /// height.
    pub fn holds(&self, p: DVec3) -> bool {
        self.height_m(p).is_some_and(|height| p.z - height <= WITHIN_M)
    }

    /// Height of the ground at a place; `None` beyond the map, NaN in its holes.
    fn height_m(&self, p: DVec3) -> Option<f64> {
        let place = (self.rotation * p.truncate() + self.translation) * self.scale;
        let cell = |v: f64, count: usize| {
            let v = v.round_ties_even();
            (v >= 0.0 && v < count as f64).then_some(v as usize)
        };
        let column = cell(place.x, self.heights.columns)?;
        let row = cell(place.y, self.heights.rows)?;
        Some(self.heights.values[row * self.heights.columns + column])
    }
}

/// The only file of a folder whose name satisfies `named`.
fn only(folder: &Path, what: &str, named: impl Fn(&str) -> bool) -> Result<PathBuf, Error> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::reading(folder))? {
        let entry = entry.map_err(Error::reading(folder))?;
        if named(&entry.file_name().to_string_lossy()) {
            found.push(entry.path());
        }
    }
    match (found.pop(), found.len()) {
        (Some(path), 0) => Ok(path),
        (None, _) => Err(Error::input(folder, "", format!("lacks {what}"))),
        (Some(_), more) => {
            let text = format!("holds {} files that could be {what}", more + 1);
            Err(Error::input(folder, "", text))
        }
    }
}
