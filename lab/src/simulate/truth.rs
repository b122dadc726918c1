//! Ground truth of a simulated drive: the files of its folder `truth/`, written and read.
//!
//! | file | content |
//! |---|---|
//! | `points/N.feather` | a row per return of `velodyne_points/data/N.bin`: [`PointTruth`] |
//! | `objects.feather` | a row per frame and object: [`ObjectTruth`] |
//! | `poses.txt` | `world_from_vehicle` per frame, 3x4 row-major |
//! | `classes.txt` | number and name of every class |

use super::layout::{self, frame_name};
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_io::Error;
use raywake_io::sink::table::TableWriter;
use raywake_io::source::feather;
use raywake_sim::{Class, Clutter, Drive, ObjectState, SimSweep};
use std::path::{Path, PathBuf};

/// Step of the difference that yields turn rates, s.
const STEP_S: f64 = 5e-4;

/// All classes, by number.
const CLASSES: [Class; 14] = [
    Class::Ground,
    Class::Building,
    Class::Pole,
    Class::Vegetation,
    Class::Fixture,
    Class::Car,
    Class::Van,
    Class::Truck,
    Class::Bus,
    Class::Tram,
    Class::Motorcycle,
    Class::Cyclist,
    Class::Pedestrian,
    Class::Clutter,
];

/// Where a return really comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTruth {
    /// Time after the sweep's stamp, s; exact even where the azimuth gives it only approximately.
    pub offset_s: f32,
    /// Index of the sensor in the rig.
    pub sensor: u8,
    /// Id of the object, 0 for the static background.
    pub object: u32,
    /// Its class.
    pub class: Class,
    /// Motion over ground of the reflecting material point within [`raywake_sim::PERIOD_S`] after
    /// the return, along the axes of the vehicle at the sweep's stamp, m.
    pub flow: [f32; 3],
}

/// An object at the stamp of a frame, in the vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectTruth {
    /// The frame.
    pub frame: u64,
    /// As in [`PointTruth::object`].
    pub id: u32,
    /// Its class.
    pub class: Class,
    /// Pose of the box, whose frame has its origin at the centre: x forward, y left, z up.
    pub vehicle_from_box: Pose,
    /// Length, width and height, m.
    pub size: [f64; 3],
    /// Velocity of the centre over ground, along the vehicle's axes, m/s.
    pub velocity: DVec3,
    /// Turn rate about the box's z axis, rad/s.
    pub yaw_rate: f64,
}

/// Name of a class in the files.
pub fn class_name(class: Class) -> &'static str {
    match class {
        Class::Ground => "Ground",
        Class::Building => "Building",
        Class::Pole => "Pole",
        Class::Vegetation => "Vegetation",
        Class::Fixture => "Fixture",
        Class::Car => "Car",
        Class::Van => "Van",
        Class::Truck => "Truck",
        Class::Bus => "Bus",
        Class::Tram => "Tram",
        Class::Motorcycle => "Motorcycle",
        Class::Cyclist => "Cyclist",
        Class::Pedestrian => "Pedestrian",
        Class::Clutter => "Clutter",
    }
}

/// The lines of `classes.txt`; clutter is listed only if there is any.
pub(super) fn classes(clutter: Clutter) -> String {
    let told = |c: &&Class| **c != Class::Clutter || clutter != Clutter::None;
    CLASSES.iter().filter(told).map(|&c| format!("{} {}\n", c as u8, class_name(c))).collect()
}

/// Path of the truth of a frame's returns in the folder of a drive.
pub fn points_path(drive: &Path, frame: u64) -> PathBuf {
    drive.join("truth/points").join(frame_name(frame as usize, "feather"))
}

/// Path of the truth of objects in the folder of a drive.
pub fn objects_path(drive: &Path) -> PathBuf {
    drive.join("truth/objects.feather")
}

/// The truth of every return of a sweep.
pub(super) fn of_points(sweep: &SimSweep) -> Vec<PointTruth> {
    let vehicle_from_world = sweep.world_from_vehicle.rotation.conjugate();
    let along = |flow: [f32; 3]| match flow {
        // Most of the world is static, and must be exactly so.
        [0.0, 0.0, 0.0] => flow,
        _ => (vehicle_from_world * DVec3::from_array(flow.map(f64::from))).as_vec3().to_array(),
    };
    let row = |(p, t): (&raywake_core::sweep::Point, &raywake_sim::Truth)| PointTruth {
        offset_s: p.offset_s,
        sensor: p.sensor as u8,
        object: t.object,
        class: t.class,
        flow: along(t.flow_world),
    };
    sweep.points.iter().zip(&sweep.truth).map(row).collect()
}

/// The truth of a drive's objects on a frame; `objects` are those at its stamp.
pub(super) fn of_objects(
    frame: u64,
    drive: &Drive,
    sweep: &SimSweep,
    objects: &[ObjectState],
) -> Vec<ObjectTruth> {
    let [before, after] = [-STEP_S, STEP_S].map(|s| drive.objects(sweep.stamp_s + s));
    let vehicle_from_world = sweep.world_from_vehicle.inverse();
    let row = |(n, o): (usize, &ObjectState)| {
        let turned = before[n].world_from_object.inverse() * after[n].world_from_object;
        ObjectTruth {
            frame,
            id: o.id,
            class: o.class,
            vehicle_from_box: vehicle_from_world * o.world_from_object,
            size: o.size,
            velocity: vehicle_from_world.rotation * o.velocity_world,
            yaw_rate: turned.twist(2.0 * STEP_S).angular.z,
        }
    };
    objects.iter().enumerate().map(row).collect()
}

/// Writes the truth of a sweep's returns.
pub fn write_points(path: &Path, rows: &[PointTruth]) -> Result<(), Error> {
    let mut t = TableWriter::default();
    t.column("offset_s", rows, |r| r.offset_s);
    t.column("sensor", rows, |r| r.sensor);
    t.column("object", rows, |r| r.object);
    t.column("class", rows, |r| r.class as u8);
    t.array(["flow_x", "flow_y", "flow_z"], rows, |r| r.flow);
    t.write(path, &[])
}

/// Reads the truth of a sweep's returns, in their order.
///
/// Fails if the file is unreadable or damaged, lacks a column, or has an impossible value.
pub fn read_points(path: &Path) -> Result<Vec<PointTruth>, Error> {
    let names = ["offset_s", "sensor", "object", "class", "flow_x", "flow_y", "flow_z"];
    let t = feather::FeatherTable::read(path, &names)?;
    let (offsets, sensors) = (t.floats("offset_s")?, t.integers("sensor")?);
    let (objects, classes) = (t.integers("object")?, t.integers("class")?);
    let flow = t.vectors(["flow_x", "flow_y", "flow_z"])?;
    let row = |n: usize| {
        let bad = |what: &str| Error::input(path, format!("row {n}"), what);
        if !(offsets[n].is_finite() && flow[n].iter().all(|v| v.is_finite())) {
            return Err(bad("a number is null or not finite"));
        }
        let class = usize::try_from(classes[n]).ok().and_then(|c| CLASSES.get(c));
        Ok(PointTruth {
            offset_s: offsets[n] as f32,
            sensor: sensors[n].try_into().map_err(|_| bad("`sensor` is out of range"))?,
            object: objects[n].try_into().map_err(|_| bad("`object` is out of range"))?,
            class: *class.ok_or_else(|| bad("no such class"))?,
            flow: flow[n],
        })
    };
    (0..t.rows()).map(row).collect()
}

/// Numeric columns of `objects.feather`, in the order of [`numbers`].
const NUMBERS: [&str; 14] = [
    "x", "y", "z", "qw", "qx", "qy", "qz", "length", "width", "height", "vx", "vy", "vz",
    "yaw_rate",
];

/// The numbers of an object.
fn numbers(o: &ObjectTruth) -> [f64; 14] {
    let (t, q, [l, w, h]) = (o.vehicle_from_box.translation, o.vehicle_from_box.rotation, o.size);
    let v = o.velocity;
    [t.x, t.y, t.z, q.w, q.x, q.y, q.z, l, w, h, v.x, v.y, v.z, o.yaw_rate]
}

/// Writes the truth of objects.
pub fn write_objects(path: &Path, rows: &[ObjectTruth]) -> Result<(), Error> {
    let mut t = TableWriter::default();
    t.column("frame", rows, |o| o.frame);
    t.column("id", rows, |o| o.id);
    t.column("class", rows, |o| class_name(o.class).to_owned());
    t.array(NUMBERS, rows, numbers);
    t.write(path, &[])
}

/// Reads the truth of objects, by frame and then by id.
///
/// Fails if the file is unreadable or damaged, lacks a column, or has an impossible value.
pub fn read_objects(path: &Path) -> Result<Vec<ObjectTruth>, Error> {
    let names: Vec<&str> = ["frame", "id", "class"].into_iter().chain(NUMBERS).collect();
    let t = feather::FeatherTable::read(path, &names)?;
    let (frames, ids, classes) = (t.integers("frame")?, t.integers("id")?, t.strings("class")?);
    let columns = NUMBERS.map(|name| t.floats(name));
    let columns: Vec<Vec<f64>> = columns.into_iter().collect::<Result<_, _>>()?;
    let row = |n: usize| {
        let bad = |what: &str| Error::input(path, format!("row {n}"), what);
        let v: Vec<f64> = columns.iter().map(|column| column[n]).collect();
        if v.iter().any(|v| !v.is_finite()) {
            return Err(bad("a number is null or not finite"));
        }
        let rotation = DQuat::from_xyzw(v[4], v[5], v[6], v[3]);
        if (rotation.length() - 1.0).abs() > 1e-6 {
            return Err(bad("the quaternion does not have length 1"));
        }
        let class = CLASSES.iter().find(|&&c| class_name(c) == classes[n]);
        Ok(ObjectTruth {
            frame: frames[n].try_into().map_err(|_| bad("`frame` is out of range"))?,
            id: ids[n].try_into().map_err(|_| bad("`id` is out of range"))?,
            class: *class.ok_or_else(|| bad("no such class"))?,
            vehicle_from_box: Pose { rotation, translation: DVec3::new(v[0], v[1], v[2]) },
            size: [v[7], v[8], v[9]],
            velocity: DVec3::new(v[10], v[11], v[12]),
            yaw_rate: v[13],
        })
    };
    (0..t.rows()).map(row).collect()
}

/// A row of `poses.txt`.
pub(super) fn pose_row(pose: &Pose) -> String {
    layout::spaced(layout::rows(pose)) + "\n"
}
