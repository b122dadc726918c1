//! A sparse map from above.

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::sink::feather::Voxel;
use raywake_render::{Cell, Look, Panel, Sign, colours};

use super::drawing::{entry, heights, look};

/// How far a picture extends, m: as far as a map.
const REACH_M: f64 = 100.0;
/// Height above the ground of the darkest columns, m: that of a tram.
const HEIGHT_M: f32 = 4.0;

/// Draws columns by the height of their highest occupied voxel, and free ones separately.
pub(super) fn view(
    world_from_vehicle: &Pose,
    voxels: &[Voxel],
    origin_m: [f64; 3],
    voxel_m: f64,
) -> (Panel, Look) {
    let vehicle_from_world = world_from_vehicle.inverse();
    let mut panel = Panel { title: "Map".into(), ..Panel::default() };
    for column in voxels.chunk_by(|a, b| a.index[..2] == b.index[..2]) {
        let top = column.iter().filter(|v| v.log_odds_tenths > 0).max_by_key(|v| v.index[2]);
        let index = top.unwrap_or(&column[0]).index.map(|i| f64::from(i) + 0.5);
        let world = DVec3::from_array(origin_m) + DVec3::from_array(index) * voxel_m;
        let at = vehicle_from_world.transform(world).as_vec3().to_array();
        match top {
            Some(_) => panel.points.push(at),
            None => panel.tiles.push(Cell {
                at: [at[0], at[1]],
                colour: colours::FREE,
                arrows: [None; 2],
            }),
        }
    }
    let legend = vec![
        heights(colours::ELEVATIONS, HEIGHT_M, "highest occupied voxel of a column"),
        entry(Sign::Cell(colours::FREE), "free (blank: not observed)"),
    ];
    let look = look(REACH_M, voxel_m, legend);
    (panel, Look { heights: colours::ELEVATIONS, height_m: HEIGHT_M, ..look })
}
