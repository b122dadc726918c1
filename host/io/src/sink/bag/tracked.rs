//! Objects as `autoware_perception_msgs/TrackedObjects`.
//!
//! Every object written exists (probability 1); unknowns (the acceleration and directions out of
//! the plane) have covariance 0. The position's covariance is that of the object's centroid.

use raywake_core::encoder::ColumnClass;
use raywake_objects::front_end::StateVariances;
use raywake_objects::tracked::TrackedObject;

use super::WORLD;
use super::cdr::Cdr;

/// `UNKNOWN`, `CAR`, `TRUCK`, `BICYCLE` and `PEDESTRIAN` of `ObjectClassification`.
const UNKNOWN: u8 = 0;
const CAR: u8 = 1;
const TRUCK: u8 = 2;
const BICYCLE: u8 = 6;
const PEDESTRIAN: u8 = 7;
/// `SIGN_UNKNOWN` and `AVAILABLE` of an orientation.
const SIGN_UNKNOWN: u8 = 1;
const AVAILABLE: u8 = 2;
/// `BOUNDING_BOX` of `Shape`.
const BOUNDING_BOX: u8 = 0;

/// The objects of a sweep.
pub(super) fn objects(stamp_ns: u64, objects: &[TrackedObject]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, WORLD);
    cdr.word(objects.len() as u32);
    objects.iter().for_each(|object| write(&mut cdr, object));
    cdr.message()
}

fn write(cdr: &mut Cdr, object: &TrackedObject) {
    let id = (u128::from(object.id)).to_be_bytes();
    id.into_iter().for_each(|byte| cdr.byte(byte));
    cdr.float(1.0);
    let (label, share) = object.class.map_or((UNKNOWN, 1.0), |(class, p)| (label(class), p));
    cdr.word(1);
    cdr.byte(label);
    cdr.float(share);
    kinematics(cdr, object);
    cdr.byte(BOUNDING_BOX);
    // No footprint.
    cdr.word(0);
    cdr.doubles(object.size.map(f64::from));
}

const fn label(class: ColumnClass) -> u8 {
    match class {
        ColumnClass::Car => CAR,
        ColumnClass::LargeVehicle => TRUCK,
        ColumnClass::Person => PEDESTRIAN,
        ColumnClass::TwoWheeler => BICYCLE,
        _ => UNKNOWN,
    }
}

/// Pose in the world; velocities along the object's axes.
fn kinematics(cdr: &mut Cdr, object: &TrackedObject) {
    let StateVariances { position: [xx, xy, yy, zz], heading, speed, turn_rate } = object.variances;
    cdr.planar(object.centre, object.heading);
    covariance(cdr, [[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, zz]], heading);
    let [u, v] = object.velocity.unwrap_or_default();
    let (sin, cos) = libm::sincos(object.heading);
    let turning = if object.velocity.is_some() { object.turn_rate } else { 0.0 };
    cdr.doubles([u * cos + v * sin, v * cos - u * sin, 0.0, 0.0, 0.0, turning]);
    covariance(cdr, [[speed, 0.0, 0.0], [0.0; 3], [0.0; 3]], turn_rate);
    // Accelerations and their covariance.
    cdr.doubles([0.0; 6 + 36]);
    cdr.byte(if object.velocity.is_some() { AVAILABLE } else { SIGN_UNKNOWN });
    cdr.byte(object.velocity.is_none().into());
}

/// 6 x 6: along the axes and about +z.
fn covariance(cdr: &mut Cdr, along: [[f32; 3]; 3], about_z: f32) {
    for row in along {
        cdr.doubles(row.into_iter().chain([0.0; 3]).map(f64::from));
    }
    cdr.doubles([0.0; 12 + 5]);
    cdr.double(about_z.into());
}
