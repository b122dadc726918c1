//! A sweep and the tracks of objects in it.

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::source::SweepData;
use raywake_objects::ObjectState;
use raywake_objects::front_end::{Life, Track};
use raywake_render::{Look, Outline, Panel, Sign, Trail, colours};

use super::drawing::{WIDE, along_vehicle, arrow, entry, look, places, return_heights, speeds};

/// How far a picture reaches, m.
const REACH_M: f64 = 50.0;
/// Width of the cells whose arrows are thinned: there are none, m.
const CELL_M: f64 = 0.4;
/// What is slower, or has come less far, is drawn as static: m/s and m.
const MOVING_MPS: f64 = 1.0;
const MOVED_M: f64 = 1.0;
/// Updates before a track is drawn, and before it is drawn as moving: filters begin with any
/// velocity.
const UPDATES_MIN: u32 = 3;
const MOVING_UPDATES_MIN: u32 = 6;
/// The smallest side of a box, m.
const SIDE_MIN_M: f32 = 0.4;

/// Live tracks, each as the box around the returns of its last update, in its filter's frame.
pub(super) fn view(sweep: &SweepData, tracks: &[Track]) -> (Panel, Look) {
    let pose = &sweep.world_from_vehicle;
    let mut panel = Panel { title: "Tracks".into(), points: places(sweep), ..Panel::default() };
    let live = |t: &&Track| t.life == Life::Live && t.observations >= UPDATES_MIN;
    for track in tracks.iter().filter(live) {
        let Some(state) = track.state() else { continue };
        let outline = outline(track, &state, pose);
        if outline.arrow.is_some() {
            panel.trails.push(trail(track, pose, outline.colour));
        }
        panel.outlines.push(outline);
    }
    // What moves lies upon what does not.
    panel.outlines.sort_by_key(|o| o.arrow.is_some());
    let still = entry(Sign::Outline(colours::BORDER), "static");
    let way = Sign::Line(raywake_render::Pen::new(colours::SPEEDS[2], WIDE));
    let legend = speeds("over ground").into_iter();
    let legend = legend.chain([entry(way, "way so far"), still, return_heights()]).collect();
    (panel, look(REACH_M, CELL_M, legend))
}

fn outline(track: &Track, state: &ObjectState, pose: &Pose) -> Outline {
    let (sin, cos) = libm::sincos(state.heading);
    let (low, high) = extent(track, state);
    let middle = [0, 1].map(|a| f64::from(0.5 * (low[a] + high[a])));
    let turned = [cos * middle[0] - sin * middle[1], sin * middle[0] + cos * middle[1], 0.0];
    let centre = [0, 1, 2].map(|a| state.position[a] + turned[a]);
    let moves = track.observations >= MOVING_UPDATES_MIN
        && state.speed.abs() >= MOVING_MPS
        && moved_m(track) >= MOVED_M;
    let velocity = along_vehicle(pose, [cos * state.speed, sin * state.speed]);
    let arrow = moves.then(|| arrow(velocity, WIDE));
    Outline {
        at: seen_from(pose, track, centre),
        forward: along_vehicle(pose, [cos, sin]),
        size: [0, 1].map(|a| (high[a] - low[a]).max(SIDE_MIN_M)),
        colour: arrow.map_or(colours::BORDER, |a| a.colour),
        label: if moves { track.id.to_string() } else { String::new() },
        arrow,
    }
}

/// Corners of the box around the returns of the last update, in the frame of the object, m.
fn extent(track: &Track, state: &ObjectState) -> ([f32; 2], [f32; 2]) {
    let returns = track.latest().iter().map(|seen| state.local(seen.position));
    returns.fold(([0.0; 2], [0.0; 2]), |(low, high), [x, y, _]| {
        ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)])
    })
}

/// From its first place to its last, m.
fn moved_m(track: &Track) -> f64 {
    let (Some(first), Some(last)) = (track.history().first(), track.history().last()) else {
        return 0.0;
    };
    let [x, y] = [0, 1].map(|a| last.position[a] - first.position[a]);
    libm::hypot(x, y)
}

fn trail(track: &Track, pose: &Pose, colour: colours::Colour) -> Trail {
    let places = track.history().iter().map(|s| seen_from(pose, track, s.position)).collect();
    Trail { places, colour, width: WIDE }
}

/// A place (m from a track's anchor) in the frame of the vehicle.
fn seen_from(world_from_vehicle: &Pose, track: &Track, at: [f64; 3]) -> [f32; 2] {
    let world = DVec3::from_array(track.anchor) + DVec3::from_array(at);
    let at = world_from_vehicle.inverse().transform(world);
    [at.x as f32, at.y as f32]
}
