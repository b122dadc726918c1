//! A sweep and the objects in it.

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::source::SweepData;
use raywake_objects::tracked::TrackedObject;
use raywake_render::{Look, Outline, Panel, Sign, Trail, colours};

use super::drawing::{WIDE, along_vehicle, arrow, entry, look, places, return_heights, speeds};

/// How far a picture extends, m.
const REACH_M: f64 = 50.0;
/// Width of the cells whose arrows are thinned, m; there are none here.
const CELL_M: f64 = 0.4;
/// Minimum side of a box, m.
const SIDE_MIN_M: f32 = 0.4;

pub(super) fn view(
    sweep: &SweepData,
    objects: &[TrackedObject],
    paths: &[Vec<[f64; 3]>],
) -> (Panel, Look) {
    let pose = &sweep.world_from_vehicle;
    let mut panel = Panel { title: "Objects".into(), points: places(sweep), ..Panel::default() };
    for (object, path) in objects.iter().zip(paths) {
        let outline = outline(object, pose);
        if outline.arrow.is_some() {
            let places = path.iter().map(|at| seen_from(pose, *at)).collect();
            panel.trails.push(Trail { places, colour: outline.colour, width: WIDE });
        }
        panel.outlines.push(outline);
    }
    // Moving objects are drawn on top of static ones.
    panel.outlines.sort_by_key(|o| o.arrow.is_some());
    let still = entry(Sign::Outline(colours::BORDER), "static");
    let trail = Sign::Line(raywake_render::Pen::new(colours::SPEEDS[2], WIDE));
    let legend = speeds("over ground").into_iter();
    let legend = legend.chain([entry(trail, "path so far"), still, return_heights()]).collect();
    (panel, look(REACH_M, CELL_M, legend))
}

/// The outline of an object, with number and class if it moves.
fn outline(object: &TrackedObject, pose: &Pose) -> Outline {
    let (sin, cos) = libm::sincos(object.heading);
    let arrow = object.velocity.map(|velocity| arrow(along_vehicle(pose, velocity), WIDE));
    let class = object.class.map_or(String::new(), |(class, _)| format!(" {}", class.name()));
    Outline {
        at: seen_from(pose, object.centre),
        forward: along_vehicle(pose, [cos, sin]),
        size: [0, 1].map(|a| object.size[a].max(SIDE_MIN_M)),
        colour: arrow.map_or(colours::BORDER, |a| a.colour),
        label: if arrow.is_some() { format!("{}{class}", object.id) } else { String::new() },
        arrow,
    }
}

/// Transforms a world position to the vehicle's frame.
fn seen_from(world_from_vehicle: &Pose, at: [f64; 3]) -> [f32; 2] {
    let at = world_from_vehicle.inverse().transform(DVec3::from_array(at));
    [at.x as f32, at.y as f32]
}
