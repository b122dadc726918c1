//! Pictures of a sweep and its flow.

use std::path::Path;

use glam::DVec3;
use raywake_core::output::{ColumnFlow, Origin};
use raywake_core::params::{Frame, Profile};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;
use raywake_render::{Arrow, Canvas, Cell, Entry, Panel, Sign, colours};

use super::{draw, look, write};
use crate::args::PictureFrame;
use raywake_io::Error;

/// An arrow is as long as the way in this time, s.
const ARROW_S: f32 = 0.5;
/// Columns slower than this are drawn as static, m/s.
const MOVING_MPS: f32 = 0.5;
/// Speed of the darkest colour, m/s: that of traffic in a town.
const FAST_MPS: f32 = 15.0;
/// Widths of arrows, pixels: of a tracklet observed so often or more, as in the author's viewer (most
/// false matches end before), and of a younger one.
const WIDE: f32 = 1.7;
const THIN: f32 = 0.8;
const AGE: u32 = 3;
/// How much further than the window a picture reaches, so that its border can be seen.
const BEYOND: f64 = 1.16;

/// What a picture of flow shows.
pub struct FlowScene<'a> {
    /// Above it, left.
    pub title: String,
    /// Above it, right.
    pub note: String,
    /// Returns of the pair's first sweep.
    pub points: &'a [Point],
    /// Its columns.
    pub columns: &'a [ColumnFlow],
    /// Its pose.
    pub world_from_vehicle: Pose,
    /// The window.
    pub profile: &'a Profile,
    /// Which velocity.
    pub frame: PictureFrame,
}

/// Writes a picture of flow.
pub fn flow(path: &Path, scene: &FlowScene) -> Result<(), Error> {
    write(path, &canvas(scene)?)
}

pub(super) fn canvas(scene: &FlowScene) -> Result<Canvas, Error> {
    let half_m = 0.5 * f64::from(scene.profile.side) * scene.profile.voxel_m;
    let mut look = look(BEYOND * half_m, scene.profile.voxel_m);
    look.legend = legend(scene.frame);
    let columns = scene.columns.iter().filter_map(|c| scene.cell(c));
    let (cells, tiles) = columns.partition(|c| c.arrows[0].is_some());
    let of = speed_of(scene.frame);
    let panel = Panel {
        title: format!("Flow {of}, {}", scene.title),
        note: scene.note.clone(),
        points: scene.points.iter().map(|p| p.position).collect(),
        tiles,
        cells,
        window: Some(scene.window(half_m)),
        vehicle: true,
        ..Panel::default()
    };
    draw(panel, &look)
}

impl FlowScene<'_> {
    /// A column whose motion is known.
    fn cell(&self, column: &ColumnFlow) -> Option<Cell> {
        if column.origin < Origin::Matched {
            return None;
        }
        let [x, y] = self.velocity(column);
        // Not `hypot`, which differs between platforms.
        let speed = (x * x + y * y).sqrt();
        let colour = colours::ramp(colours::SPEEDS, speed / FAST_MPS);
        let moving = speed >= MOVING_MPS;
        let way = [x, y].map(|v| v * ARROW_S);
        let width = if column.age >= AGE { WIDE } else { THIN };
        let arrow = moving.then_some(Arrow { way, colour, width });
        let colour = if moving { colour } else { colours::STATIC };
        Some(Cell { at: column.position_vehicle_m, colour, arrows: [arrow, None] })
    }

    /// Along the vehicle's axes, m/s.
    fn velocity(&self, column: &ColumnFlow) -> [f32; 2] {
        match self.frame {
            PictureFrame::Ego => column.velocity_ego_mps,
            PictureFrame::World => {
                let [x, y] = column.velocity_world_mps.map(f64::from);
                self.vehicle_from_world([x, y])
            }
        }
    }

    fn vehicle_from_world(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        let along = self.world_from_vehicle.rotation.conjugate() * DVec3::new(x, y, 0.0);
        [along.x as f32, along.y as f32]
    }

    /// Corners of the window around the vehicle, within half a voxel.
    fn window(&self, half_m: f64) -> [[f32; 2]; 4] {
        let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];
        corners.map(|[x, y]: [f64; 2]| match self.profile.frame {
            Frame::Lattice => self.vehicle_from_world([x * half_m, y * half_m]),
            Frame::Sensor => [x * half_m, y * half_m].map(|v| v as f32),
        })
    }
}

/// Relative to what.
fn speed_of(frame: PictureFrame) -> &'static str {
    match frame {
        PictureFrame::World => "over ground",
        PictureFrame::Ego => "relative to the vehicle",
    }
}

fn legend(frame: PictureFrame) -> Vec<Entry> {
    let entry = |sign, text: &str| Entry { sign, text: text.to_string() };
    let fast = [0.0, 1.0].map(|t| format!("{}", t * FAST_MPS));
    let arrow = |speed: f32, width| {
        let colour = colours::ramp(colours::SPEEDS, speed / FAST_MPS);
        Sign::Arrow(Arrow { way: [speed * ARROW_S, 0.0], colour, width })
    };
    let speed = format!("m/s {}", speed_of(frame));
    let [low, high] = fast;
    vec![
        entry(Sign::Ramp(colours::SPEEDS, [low, format!("≥ {high}")]), &speed),
        entry(arrow(10.0, WIDE), &format!("10 m/s ({ARROW_S} s of motion)")),
        entry(arrow(4.0, THIN), &format!("observed less than {AGE} times")),
        entry(Sign::Cell(colours::STATIC), "static foreground"),
        entry(
            Sign::Ramp(colours::HEIGHTS, ["0".into(), format!("{} m", super::HEIGHT_M)]),
            "height of returns",
        ),
        entry(Sign::Line(raywake_render::WINDOW), "window: no estimate outside"),
    ]
}
