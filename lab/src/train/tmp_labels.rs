//! TEMPORARY
use crate::labels::*;
use raywake_core::pose::Pose;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
pub fn open(folder: &Path) -> Result<Labels, Box<dyn Error>> {
    let text = std::fs::read_to_string(folder.join("boxes.csv"))?;
    let mut tracks: BTreeMap<String, Track> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let f: Vec<&str> = line.split(',').collect();
        let n = |i: usize| f[i].parse::<f64>().unwrap();
        let kind = match f[2] { "Car"|"REGULAR_VEHICLE" => Kind::Car, "Van" => Kind::Van, "Cyclist" => Kind::Cyclist, "Pedestrian"|"PEDESTRIAN" => Kind::Pedestrian, _ => Kind::Other };
        let t = tracks.entry(f[1].into()).or_insert_with(|| Track { id: f[1].into(), class: f[2].into(), kind, size: [n(6), n(7), n(8)], boxes: BTreeMap::new() });
        t.boxes.insert(f[0].parse()?, Pose::planar(n(3), n(4), n(5), n(9)));
    }
    let view = if folder.to_string_lossy().contains("kitti") { View::Camera } else { View::All };
    Ok(Labels { tracks: tracks.into_values().collect(), view, notes: vec![] })
}
