//! Objects and motion as `visualization_msgs/Marker`, which rviz shows.

use raywake_objects::tracked::TrackedObject;

use super::cdr::Cdr;
use super::{AHEAD_S, BOX_SHOWN_NS, LINE_M, MOVING, MovingColumn, STATIONARY, VEHICLE, WORLD};

/// `CUBE` and `LINE_LIST` of the message.
const CUBE: u32 = 1;
const LINE_LIST: u32 = 5;

/// The box of an object.
pub(super) fn cube(stamp_ns: u64, object: &TrackedObject) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, WORLD);
    cdr.text("objects");
    [object.id, CUBE, 0].into_iter().for_each(|n| cdr.word(n));
    cdr.planar(object.centre, object.heading);
    cdr.doubles(object.size.map(|v| f64::from(v).max(LINE_M)));
    let colour = if object.velocity.is_some() { MOVING } else { STATIONARY };
    colour.into_iter().for_each(|v| cdr.float(v));
    [0, BOX_SHOWN_NS].into_iter().for_each(|n| cdr.word(n));
    cdr.byte(0);
    cdr.word(0);
    finish_marker(&mut cdr);
    cdr.message()
}

/// Lines along motions, shown until the next sweep's.
pub(super) fn lines(stamp_ns: u64, moving: &[MovingColumn]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, VEHICLE);
    cdr.text("motion");
    // ID, type, and action: add or replace.
    [0, LINE_LIST, 0].into_iter().for_each(|n| cdr.word(n));
    cdr.planar([0.0; 3], 0.0);
    cdr.doubles([LINE_M, 0.0, 0.0]);
    MOVING.into_iter().for_each(|v| cdr.float(v));
    // Shown until replaced, and locked to its frame.
    [0, 0].into_iter().for_each(|n| cdr.word(n));
    cdr.byte(1);
    cdr.word(2 * moving.len() as u32);
    for MovingColumn { at: [x, y], velocity: [u, v] } in moving {
        let ends = [[*x, *y], [x + AHEAD_S * u, y + AHEAD_S * v]];
        ends.into_iter().for_each(|[x, y]| cdr.doubles([x.into(), y.into(), 0.0]));
    }
    finish_marker(&mut cdr);
    cdr.message()
}

/// The rest of a marker without point colours, texture, text or mesh.
fn finish_marker(cdr: &mut Cdr) {
    cdr.word(0);
    cdr.text("");
    cdr.header(0, "");
    cdr.text("");
    cdr.bytes(|_| ());
    cdr.word(0);
    ["", "", ""].into_iter().for_each(|text| cdr.text(text));
    cdr.bytes(|_| ());
    cdr.byte(0);
}
