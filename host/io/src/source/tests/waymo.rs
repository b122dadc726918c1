//! A synthetic Waymo segment.

use std::f32::consts::FRAC_PI_4;
use std::fs::File;
use std::sync::Arc;

use super::*;
use crate::source::Unlocated;
use arrow_array::types::{Float32Type, Float64Type, Int32Type};
use arrow_array::{
    ArrayRef, FixedSizeListArray, Float64Array, Int8Array, Int64Array, ListArray, RecordBatch,
};
use parquet::arrow::ArrowWriter;

/// Times of the sweeps, µs.
const TIMES: [i64; 3] = [1_550_000_000_000_000, 1_550_000_000_100_000, 1_550_000_000_200_000];
/// Rows and columns of an image.
const SIZE: [usize; 2] = [2, 4];
const PIXELS: usize = SIZE[0] * SIZE[1];
/// Ranges of the returns, m; -1 if there is none.
const RANGES: [f32; PIXELS] = [10.0, 20.0, -1.0, 10.0, 5.0, -1.0, 5.0, 5.0];

fn list<const N: usize>(values: [f64; N]) -> Option<Vec<Option<f64>>> {
    Some(values.map(Some).to_vec())
}

/// A pose without tilt, row by row.
fn matrix(x: f64, y: f64, z: f64, turn: f64) -> Option<Vec<Option<f64>>> {
    let (s, c) = turn.sin_cos();
    list([c, -s, 0.0, x, s, c, 0.0, y, 0.0, 0.0, 1.0, z, 0.0, 0.0, 0.0, 1.0])
}

fn fixed(rows: Vec<Option<Vec<Option<f64>>>>) -> ArrayRef {
    Arc::new(FixedSizeListArray::from_iter_primitive::<Float64Type, _, _>(rows, 16))
}

fn lists(rows: Vec<Option<Vec<Option<f64>>>>) -> ArrayRef {
    Arc::new(ListArray::from_iter_primitive::<Float64Type, _, _>(rows))
}

/// Images and their shapes.
fn images(rows: &[(Vec<f32>, [i32; 3])]) -> [ArrayRef; 2] {
    let values = rows.iter().map(|(v, _)| Some(v.iter().copied().map(Some).collect::<Vec<_>>()));
    let shapes = rows.iter().map(|(_, shape)| Some(shape.map(Some).to_vec()));
    [
        Arc::new(ListArray::from_iter_primitive::<Float32Type, _, _>(values)),
        Arc::new(FixedSizeListArray::from_iter_primitive::<Int32Type, _, _>(shapes, 3)),
    ]
}

fn table(t: &Temp, folder: &str, columns: Vec<(String, ArrayRef)>) {
    let path = t.write(&format!("{folder}/seg.parquet"), b"");
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let mut writer =
        ArrowWriter::try_new(File::create(path).unwrap(), batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
}

fn keys(lasers: &[i8]) -> Vec<(String, ArrayRef)> {
    let times = TIMES.iter().flat_map(|us| lasers.iter().map(move |_| *us));
    let numbers = TIMES.iter().flat_map(|_| lasers.iter().copied());
    vec![
        ("key.frame_timestamp_micros".into(), Arc::new(Int64Array::from_iter_values(times)) as _),
        ("key.laser_name".into(), Arc::new(Int8Array::from_iter_values(numbers)) as _),
    ]
}

/// Three sweeps of the roof laser and one at the left, turned by a right angle; the vehicle moves 1
/// m per sweep, and was half a metre further on at every pixel of the roof laser.
pub(super) fn segment(channels: usize) -> Temp {
    let t = Temp::new();
    let named = |group: &str, name: &str| format!("[{group}].{name}");
    let calibration = |name: &str| named("LiDARCalibrationComponent", name);
    let number = |v: f64| Arc::new(Float64Array::from(vec![v; 2])) as ArrayRef;
    let inclination = |name: &str| calibration(&format!("beam_inclination.{name}"));
    let poses =
        vec![matrix(1.0, 0.0, 2.0, 0.0), matrix(3.0, 1.0, 1.0, std::f64::consts::FRAC_PI_2)];
    table(
        &t,
        "lidar_calibration",
        vec![
            ("key.laser_name".into(), Arc::new(Int8Array::from(vec![1, 3]))),
            (calibration("extrinsic.transform"), fixed(poses)),
            (inclination("min"), number(-0.4)),
            (inclination("max"), number(0.4)),
            (inclination("values"), lists(vec![list([-0.1, 0.2]), None])),
        ],
    );
    let vehicle = (0..3).map(|n| matrix(100.0 + n as f64, 50.0, 0.0, 0.0)).collect();
    let mut columns = vec![keys(&[1]).remove(0)];
    columns.push((named("VehiclePoseComponent", "world_from_vehicle.transform"), fixed(vehicle)));
    table(&t, "vehicle_pose", columns);
    let pixel = |range: f32| [range, 0.5, 0.0, -1.0].into_iter().take(channels);
    let image: Vec<f32> = RANGES.into_iter().flat_map(pixel).collect();
    let shape = [SIZE[0] as i32, SIZE[1] as i32, channels as i32];
    let [values, shapes] = images(&vec![(image, shape); 6]);
    let columns = [
        (named("LiDARComponent", "range_image_return1.values"), values),
        (named("LiDARComponent", "range_image_return1.shape"), shapes),
    ];
    table(&t, "lidar", [keys(&[1, 3]), columns.into()].concat());
    let of_sweep = |n: usize| {
        let pose = [0.0, 0.0, 0.0, 100.5 + n as f32, 50.0, 0.0];
        (pose.repeat(PIXELS), [SIZE[0] as i32, SIZE[1] as i32, 6])
    };
    let [values, shapes] = images(&[of_sweep(0), of_sweep(1), of_sweep(2)]);
    let columns = [
        (named("LiDARPoseComponent", "range_image_return1.values"), values),
        (named("LiDARPoseComponent", "range_image_return1.shape"), shapes),
    ];
    table(&t, "lidar_pose", [keys(&[1]), columns.into()].concat());
    t
}

#[test]
fn a_segment_is_read() {
    let t = segment(4);
    let mut source = open(t.path(), &OpenOptions::default()).unwrap();
    assert_eq!((source.name(), source.len(), source.rig().sensors.len()), ("seg", 3, 2));
    assert!(source.describe().contains("Waymo segment seg") && !source.rig().distorted);
    assert_eq!(source.overview().epoch_ns, TIMES[0] as u64 * 1000);
    let mut sweep = SweepData::default();
    // Backwards too.
    for index in [2, 0, 1] {
        source.read(index, &mut sweep).unwrap();
        assert_eq!(sweep.world_from_vehicle.translation.x, 100.0 + index as f64);
        assert_eq!(sweep.points.len(), 12);
    }
    assert!((sweep.stamp_s - 0.1).abs() < 1e-9);
    // The first column points midway between rear and left, the next midway between left and ahead.
    let directions = [3.0, 1.0, -1.0, -3.0].map(|quarters| quarters * FRAC_PI_4);
    let lasers = [([1.5, 0.0, 2.0], [0.2, -0.1]), ([3.0, 1.0, 1.0], [0.2, -0.2])];
    let expected = lasers.into_iter().enumerate().flat_map(|(sensor, (from, inclinations))| {
        (0..PIXELS).filter(|n| RANGES[*n] > 0.0).map(move |n| {
            let (up, to) = (inclinations[n / SIZE[1]], directions[n % SIZE[1]]);
            let (along, height) = (RANGES[n] * f32::cos(up), RANGES[n] * f32::sin(up));
            let at = [from[0] + along * to.cos(), from[1] + along * to.sin(), from[2] + height];
            (at, sensor as u32)
        })
    });
    for (point, (at, sensor)) in sweep.points.iter().zip(expected) {
        let apart = (0..3).map(|a| (point.position[a] - at[a]).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-4 && point.sensor == sensor, "{point:?}, not at {at:?}");
        assert!(point.intensity == 0.5 && point.offset_s == 0.0);
    }
    let unlocated = OpenOptions { unlocated: Unlocated::Always, ..OpenOptions::default() };
    assert!(!open(t.path(), &unlocated).unwrap().is_located());
}

#[test]
fn errors_in_segments_are_reported() {
    let t = segment(4);
    let asked = |names: &[&str]| {
        let topics = names.iter().map(|name| (*name).into()).collect();
        open(t.path(), &OpenOptions { topics, ..OpenOptions::default() }).err().unwrap().to_string()
    };
    assert!(asked(&["x"]).contains("no segment x; available: seg"));
    assert!(asked(&["x", "y"]).contains("one segment at a time"));
    fs::copy(t.path().join("lidar/seg.parquet"), t.path().join("lidar/two.parquet")).unwrap();
    assert!(asked(&[]).contains("2 segments, choose with --topic: seg, two"));
    assert!(asked(&["two"]).contains("two.parquet"));
    for (folder, from, what) in [
        ("lidar", "lidar_pose", "column `[LiDARComponent].range_image_return1.values`"),
        ("lidar_pose", "vehicle_pose", "column `key.laser_name`"),
        ("vehicle_pose", "lidar_pose", "world_from_vehicle.transform"),
        ("lidar_calibration", "lidar", "extrinsic.transform"),
    ] {
        let t = segment(4);
        let [to, from] = [folder, from].map(|name| t.path().join(name).join("seg.parquet"));
        fs::copy(from, &to).unwrap();
        let e = open(t.path(), &OpenOptions::default()).err().unwrap().to_string();
        assert!(e.contains(what) && e.contains(folder), "{what} in {e}");
        fs::write(&to, b"PAR1 and no more").unwrap();
        assert!(open(t.path(), &OpenOptions::default()).is_err());
        t.remove(&format!("{folder}/seg.parquet"));
        assert!(open(t.path(), &OpenOptions::default()).is_err());
    }
    let t = segment(4);
    let [to, from] =
        ["lidar_calibration", "even"].map(|name| t.path().join(name).join("seg.parquet"));
    // Like the calibration of lasers whose beams are evenly spaced, but with a null as one limit.
    let named = |name: &str| format!("[LiDARCalibrationComponent].{name}");
    table(
        &t,
        "even",
        vec![
            ("key.laser_name".into(), Arc::new(Int8Array::from(vec![1]))),
            (named("extrinsic.transform"), fixed(vec![matrix(0.0, 0.0, 2.0, 0.0)])),
            (named("beam_inclination.min"), Arc::new(Float64Array::from(vec![None]))),
            (named("beam_inclination.max"), Arc::new(Float64Array::from(vec![0.1]))),
            (named("beam_inclination.values"), lists(vec![None])),
        ],
    );
    fs::copy(from, to).unwrap();
    let e = open(t.path(), &OpenOptions::default()).err().unwrap().to_string();
    assert!(e.contains("neither beam inclinations nor their range"), "{e}");
    let t = segment(1);
    let e = open(t.path(), &OpenOptions::default()).unwrap().read(0, &mut SweepData::default());
    let e = e.unwrap_err().to_string();
    assert!(e.contains("row 0, laser 1: pixels of 1 numbers"), "{e}");
}
