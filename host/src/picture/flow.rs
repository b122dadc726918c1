//! A sweep and its flow.

use raywake_core::output::{ColumnFlow, FlowBasis};
use raywake_core::params::{Frame, Profile};
use raywake_core::pose::Pose;
use raywake_io::source::SweepData;
use raywake_render::{Cell, LegendEntry, Look, Panel, Sign, WINDOW, colours};

use super::drawing::{
    WIDE, along_vehicle, arrow, entry, look, places, return_heights, speed, speeds,
};
use crate::args::PictureFrame;

/// Columns slower than this are drawn as static, m/s.
const MOVING_MPS: f32 = 0.5;
/// Width of the arrow of a tracklet observed fewer than [`AGE`] times, pixels.
const THIN: f32 = 0.8;
/// As in the author's viewer: most false matches end sooner.
const AGE: u32 = 3;
/// How far a picture extends relative to the window, so that the window's border is visible.
pub(super) const BEYOND: f64 = 1.16;

pub(super) fn view(
    sweep: &SweepData,
    columns: &[ColumnFlow],
    profile: &Profile,
    frame: PictureFrame,
) -> (Panel, Look) {
    let pose = &sweep.world_from_vehicle;
    let half_m = 0.5 * f64::from(profile.side) * profile.voxel_m;
    let of = match frame {
        PictureFrame::World => "over ground",
        PictureFrame::Ego => "relative to the vehicle",
    };
    let drawn = columns.iter().filter(|c| c.basis >= FlowBasis::Matched);
    let drawn = drawn.map(|column| cell(column, pose, frame));
    let (cells, tiles) = drawn.partition(|c| c.arrows[0].is_some());
    let panel = Panel {
        title: format!("Flow {of}"),
        points: places(sweep),
        tiles,
        cells,
        window: Some(window(half_m, profile.frame, pose)),
        ..Panel::default()
    };
    (panel, look(BEYOND * half_m, profile.voxel_m, legend(of)))
}

/// A matched column, with an arrow if it moves.
fn cell(column: &ColumnFlow, pose: &Pose, frame: PictureFrame) -> Cell {
    let velocity = match frame {
        PictureFrame::Ego => column.velocity_ego_mps,
        PictureFrame::World => along_vehicle(pose, column.velocity_world_mps.map(f64::from)),
    };
    let width = if column.age >= AGE { WIDE } else { THIN };
    let arrow = (speed(velocity) >= MOVING_MPS).then(|| arrow(velocity, width));
    let colour = arrow.map_or(colours::STATIC, |a| a.colour);
    Cell { at: column.position_vehicle_m, colour, arrows: [arrow, None] }
}

/// Corners of the window around the vehicle, accurate to half a voxel.
fn window(half_m: f64, frame: Frame, pose: &Pose) -> [[f32; 2]; 4] {
    let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];
    corners.map(|corner: [f64; 2]| match frame {
        Frame::Lattice => along_vehicle(pose, corner.map(|v| v * half_m)),
        Frame::Sensor => corner.map(|v| (v * half_m) as f32),
    })
}

fn legend(of: &str) -> Vec<LegendEntry> {
    let young =
        entry(Sign::Arrow(arrow([4.0, 0.0], THIN)), &format!("observed fewer than {AGE} times"));
    let still = entry(Sign::Cell(colours::STATIC), "static foreground");
    let window = entry(Sign::Line(WINDOW), "window: no estimate outside");
    speeds(of).into_iter().chain([young, still, return_heights(), window]).collect()
}
