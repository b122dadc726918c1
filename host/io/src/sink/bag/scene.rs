//! Objects and motion as `foxglove_msgs/SceneUpdate`, which Foxglove and Lichtblick show; clicking
//! on an object shows its attributes.

use raywake_objects::tracked::TrackedObject;

use super::cdr::Cdr;
use super::{AHEAD_S, BOX_SHOWN_NS, LINE_M, MOVING, MovingColumn, STATIONARY, VEHICLE, WORLD};

/// Height of a name, and its distance above the box, m.
const TEXT_M: f64 = 0.6;
/// Opacity of a box: its contents stay visible.
const BOX_OPACITY: f32 = 0.35;

/// An entity: its parts, in the order of the message; spheres and other shapes are left out.
#[derive(Default)]
struct Entity {
    metadata: Vec<(&'static str, String)>,
    /// Positions, directions about +z (rad) and lengths (m).
    arrows: Vec<([f64; 3], f64, f64)>,
    /// Position, direction and size of a box.
    cube: Option<([f64; 3], f64, [f64; 3])>,
    /// Position of a name, and the name.
    text: Option<([f64; 3], String)>,
    colour: [f32; 4],
}

/// Motions as arrows, shown until the next sweep's.
pub(super) fn motion(stamp_ns: u64, moving: &[MovingColumn]) -> Vec<u8> {
    let arrow = |m: &MovingColumn| {
        let [u, v] = m.velocity;
        let length = f64::from(AHEAD_S * u.hypot(v));
        ([m.at[0].into(), m.at[1].into(), 0.0], f64::from(v.atan2(u)), length)
    };
    let entity =
        Entity { arrows: moving.iter().map(arrow).collect(), colour: MOVING, ..Entity::default() };
    let mut cdr = Cdr::new();
    [0, 1].into_iter().for_each(|n| cdr.word(n));
    cdr.header(stamp_ns, VEHICLE);
    cdr.text("motion");
    lifetime(&mut cdr, 0, true);
    entity.write(&mut cdr);
    cdr.message()
}

/// Objects: one entity each.
pub(super) fn objects(stamp_ns: u64, objects: &[TrackedObject]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    [0, objects.len() as u32].into_iter().for_each(|n| cdr.word(n));
    for object in objects {
        cdr.header(stamp_ns, WORLD);
        cdr.text(&object.id.to_string());
        lifetime(&mut cdr, BOX_SHOWN_NS, false);
        Entity::of(object).write(&mut cdr);
    }
    cdr.message()
}

/// How long an entity is shown, ns (0: until it is replaced), and whether it moves with its frame.
fn lifetime(cdr: &mut Cdr, shown_ns: u32, locked: bool) {
    [0, shown_ns].into_iter().for_each(|n| cdr.word(n));
    cdr.byte(locked.into());
}

impl Entity {
    fn of(object: &TrackedObject) -> Entity {
        let TrackedObject { id, centre, heading, size, velocity, p_moves, class, .. } = object;
        let [x, y, z] = *centre;
        let speed = velocity.map(|[u, v]| u.hypot(v));
        let class = class.map_or("unknown", |(class, _)| class.name());
        let entry = |name, value: Option<String>| value.map(|value| (name, value));
        let metadata = [
            entry("track", Some(id.to_string())),
            entry("class", Some(class.into())),
            entry("speed m/s", Some(format!("{:.2}", speed.unwrap_or(0.0)))),
            entry("P(moves)", p_moves.map(|p| format!("{p:.2}"))),
            entry("length m", Some(format!("{:.2}", size[0]))),
            entry("width m", Some(format!("{:.2}", size[1]))),
            entry("height m", Some(format!("{:.2}", size[2]))),
        ];
        let course = velocity.map(|[u, v]| v.atan2(u));
        let arrow = |(speed, course)| (*centre, course, f64::from(AHEAD_S) * speed);
        let name = |speed| format!("{id} {class} {speed:.1} m/s");
        let above = [x, y, z + 0.5 * f64::from(size[2]) + TEXT_M];
        Entity {
            metadata: metadata.into_iter().flatten().collect(),
            arrows: speed.zip(course).map(arrow).into_iter().collect(),
            cube: Some((*centre, *heading, size.map(|v| f64::from(v).max(LINE_M)))),
            text: speed.map(|speed| (above, name(speed))),
            colour: if velocity.is_some() { MOVING } else { STATIONARY },
        }
    }

    fn write(&self, cdr: &mut Cdr) {
        let [r, g, b, opacity] = self.colour;
        cdr.word(self.metadata.len() as u32);
        for (name, value) in &self.metadata {
            [name, value.as_str()].into_iter().for_each(|text| cdr.text(text));
        }
        cdr.word(self.arrows.len() as u32);
        for (at, direction, length) in &self.arrows {
            // The head is a third of the length, twice as thick as the shaft.
            cdr.planar(*at, *direction);
            cdr.doubles([length * 2.0 / 3.0, LINE_M, length / 3.0, 2.0 * LINE_M]);
            cdr.doubles([r, g, b, opacity].map(f64::from));
        }
        cdr.word(self.cube.is_some().into());
        if let Some((at, direction, size)) = self.cube {
            cdr.planar(at, direction);
            cdr.doubles(size);
            cdr.doubles([r, g, b, BOX_OPACITY].map(f64::from));
        }
        // No spheres, cylinders, lines or triangles.
        [0; 4].into_iter().for_each(|n| cdr.word(n));
        cdr.word(self.text.is_some().into());
        if let Some((at, text)) = &self.text {
            cdr.planar(*at, 0.0);
            // It faces the viewer; its size is in metres.
            cdr.byte(1);
            cdr.double(TEXT_M);
            cdr.byte(0);
            cdr.doubles([r, g, b, 1.0].map(f64::from));
            cdr.text(text);
        }
        // No models.
        cdr.word(0);
    }
}
