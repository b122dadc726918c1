//! Argoverse 2 logs, written with the Arrow writer.

use std::sync::Arc;

use arrow_array::types::{ArrowPrimitiveType, Float16Type, Int8Type};
use arrow_array::{
    ArrayRef, BooleanArray, DictionaryArray, Float16Array, Float64Array, Int8Array, Int32Array,
    Int64Array, NullArray, RecordBatch, StringArray, UInt8Array,
};
use arrow_ipc::CompressionType;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use raywake_core::sweep::Timing;

use super::super::feather::FeatherTable;
use super::*;

const STAMP: i64 = 315_966_265_259_836_000;

fn half(v: f32) -> <Float16Type as ArrowPrimitiveType>::Native {
    <Float16Type as ArrowPrimitiveType>::Native::from_f32(v)
}

fn batch(columns: Vec<(&str, ArrayRef)>) -> RecordBatch {
    RecordBatch::try_from_iter(columns).unwrap()
}

fn file(batches: &[RecordBatch], compression: Option<CompressionType>) -> Vec<u8> {
    let options = IpcWriteOptions::default().try_with_compression(compression).unwrap();
    let mut writer =
        FileWriter::try_new_with_options(Vec::new(), &batches[0].schema(), options).unwrap();
    for batch in batches {
        writer.write(batch).unwrap();
    }
    writer.into_inner().unwrap()
}

fn floats(values: Vec<f64>) -> ArrayRef {
    Arc::new(Float64Array::from(values))
}

/// Columns of poses along x.
fn poses<'a>(x: Vec<f64>) -> Vec<(&'a str, ArrayRef)> {
    let n = x.len();
    let mut columns = vec![("qw", floats(vec![1.0; n]))];
    columns.extend(["qx", "qy", "qz"].map(|c| (c, floats(vec![0.0; n]))));
    columns.extend([("tx_m", floats(x)), ("ty_m", floats(vec![0.0; n]))]);
    columns.push(("tz_m", floats(vec![1.6; n])));
    columns
}

/// A sweep of points with these lasers; x increases from `first`.
fn sweep(first: f32, lasers: &[u8]) -> RecordBatch {
    let n = lasers.len();
    let x = (0..n).map(|i| half(first + i as f32)).collect::<Vec<_>>();
    batch(vec![
        ("x", Arc::new(Float16Array::from(x))),
        ("y", Arc::new(Float16Array::from(vec![half(-1.5); n]))),
        ("z", Arc::new(Float16Array::from(vec![half(0.25); n]))),
        ("intensity", Arc::new(UInt8Array::from(vec![255; n]))),
        ("laser_number", Arc::new(UInt8Array::from(lasers.to_vec()))),
        ("offset_ns", Arc::new(Int32Array::from(vec![50_000_000; n]))),
    ])
}

fn city(stamps: Vec<i64>) -> Vec<u8> {
    let x = (0..stamps.len()).map(|i| i as f64).collect();
    let mut columns: Vec<(&str, ArrayRef)> =
        vec![("timestamp_ns", Arc::new(Int64Array::from(stamps)))];
    columns.extend(poses(x));
    file(&[batch(columns)], None)
}

fn calibration(names: Vec<&str>) -> Vec<u8> {
    let n = names.len();
    let mut columns: Vec<(&str, ArrayRef)> =
        vec![("sensor_name", Arc::new(StringArray::from(names)))];
    columns.extend(poses((0..n).map(|i| i as f64).collect()));
    file(&[batch(columns)], None)
}

const FIRST: &str = "val/log/sensors/lidar/315966265259836000.feather";
const CITY: &str = "val/log/city_SE3_egovehicle.feather";
const CALIBRATION: &str = "val/log/calibration/egovehicle_SE3_sensor.feather";

pub(super) fn log() -> Temp {
    let t = Temp::new();
    // Two batches, compressed.
    let batches = [sweep(10.0, &[0, 40]), sweep(20.0, &[31])];
    t.write(FIRST, file(&batches, Some(CompressionType::LZ4_FRAME)));
    let second = file(&batches[..1], Some(CompressionType::ZSTD));
    t.write("val/log/sensors/lidar/315966265359836000.feather", second);
    t.write(CITY, city(vec![STAMP - 7, STAMP, STAMP + 50_000_000, STAMP + 100_000_000]));
    t.write(CALIBRATION, calibration(vec!["ring_rear_left", "up_lidar", "down_lidar"]));
    t
}

#[test]
fn a_log() {
    let t = log();
    let mut source = opened(t.path());
    assert_eq!((source.name(), source.len()), ("log", 2));
    assert_eq!(source.frame(0), STAMP as u64);
    assert!(source.notes().is_empty(), "{:?}", source.notes());
    let rig = source.rig().clone();
    assert!(!rig.distorted && rig.ground_m == -0.33);
    assert_eq!(rig.timing, Timing::Offset { from_s: 0.0, span_s: 0.11 });
    assert_eq!([rig.sensors[0].translation.x, rig.sensors[1].translation.x], [1.0, 2.0]);
    let first = read(source.as_mut(), 0).unwrap();
    assert_eq!(first.points.iter().map(|p| p.sensor).collect::<Vec<_>>(), [0, 1, 0]);
    let p = first.points[2];
    assert_eq!((p.position, p.intensity, p.offset_s), ([20.0, -1.5, 0.25], 1.0, 0.05));
    let second = read(source.as_mut(), 1).unwrap();
    assert!((second.stamp_s - 0.1).abs() < 1e-12);
    assert_eq!(second.world_from_vehicle.translation.x, 3.0);
    assert_eq!((source.stamp_s(1), source.pose(1)), (second.stamp_s, second.world_from_vehicle));
    // From pose 1 to pose 3 in 0.1 s.
    assert!((second.twist.linear.x - 20.0).abs() < 1e-6);
}

#[test]
fn poses_near_the_stamp() {
    let t = log();
    t.write(CITY, city(vec![STAMP + 900_000, STAMP + 100_000_000]));
    assert!(opened(t.path()).notes()[0].contains("1 sweeps without a pose at their stamp"));
    t.write(CITY, city(vec![STAMP + 1_100_000, STAMP + 100_000_000]));
    let text = refused(t.path());
    assert!(text.contains("city_SE3_egovehicle.feather: no pose for sweep 315966265259836000"));
    t.write(CITY, city(vec![]));
    assert!(refused(t.path()).contains("no pose for sweep"));
}

#[test]
fn missing_and_wrong_columns() {
    let t = log();
    let whole = sweep(10.0, &[0, 40]);
    let without = whole.project(&[0, 1, 2, 3, 4]).unwrap();
    t.write(FIRST, file(&[without], None));
    assert!(refused(t.path()).contains("315966265259836000.feather: has no column `offset_ns`"));
    let mut columns: Vec<(&str, ArrayRef)> = vec![("x", Arc::new(StringArray::from(vec!["1"])))];
    let one = sweep(1.0, &[0]);
    for name in ["y", "z", "intensity", "laser_number", "offset_ns"] {
        columns.push((name, one.column_by_name(name).unwrap().clone()));
    }
    t.write(FIRST, file(&[batch(columns)], None));
    assert!(refused(t.path()).contains("column `x` is Utf8, not floats"));
    t.write(FIRST, file(&[sweep(1.0, &[0, 64])], None));
    assert!(refused(t.path()).contains("row 1: laser_number 64"));
    t.write(FIRST, file(&[whole], None));
    t.write(CALIBRATION, calibration(vec!["up_lidar"]));
    assert!(refused(t.path()).contains("has no row `down_lidar`"));
    t.remove("val/log/calibration/egovehicle_SE3_sensor.feather");
    assert!(refused(t.path()).contains("cannot read"));
}

#[test]
fn an_invalid_pose() {
    let t = log();
    let mut columns: Vec<(&str, ArrayRef)> =
        vec![("timestamp_ns", Arc::new(Int64Array::from(vec![STAMP, STAMP + 100_000_000])))];
    columns.extend(poses(vec![0.0, f64::NAN]));
    t.write(CITY, file(&[batch(columns.clone())], None));
    assert!(refused(t.path()).contains("row 1: a pose with a NaN"));
    columns[1] = ("qw", floats(vec![0.5, 1.0]));
    t.write(CITY, file(&[batch(columns)], None));
    assert!(refused(t.path()).contains("row 0: the quaternion"));
}

#[test]
fn nulls_become_nan() {
    let t = log();
    let mut columns: Vec<(&str, ArrayRef)> =
        vec![("x", Arc::new(Float16Array::from(vec![None, Some(half(1.0))])))];
    let two = sweep(1.0, &[0, 1]);
    for name in ["y", "z", "intensity", "laser_number", "offset_ns"] {
        columns.push((name, two.column_by_name(name).unwrap().clone()));
    }
    t.write(FIRST, file(&[batch(columns)], None));
    let sweep = read(opened(t.path()).as_mut(), 0).unwrap();
    assert!(sweep.points[0].position[0].is_nan() && sweep.points.len() == 2);
    assert_eq!(sweep.dropped.null_rows, 1);
}

#[test]
fn no_cut_or_flipped_byte_panics() {
    let many: Vec<u8> = (0..64).collect();
    let columns = ["x", "intensity", "offset_ns"];
    for compression in [None, Some(CompressionType::LZ4_FRAME), Some(CompressionType::ZSTD)] {
        let good = file(&[sweep(10.0, &many)], compression);
        let parse = |bytes: &[u8]| FeatherTable::parse(Path::new("f.feather"), bytes, &columns);
        assert!(parse(&good).is_ok());
        for cut in 0..good.len() {
            let text = parse(&good[..cut]).map(|_| ()).unwrap_err().to_string();
            assert!(text.starts_with("f.feather: "), "{text}");
        }
        for place in 0..good.len() {
            for flip in [0xff, 0x80, 0x01] {
                let mut bad = good.clone();
                bad[place] ^= flip;
                // Either an error or other numbers, never a panic.
                if let Ok(table) = parse(&bad) {
                    let _ = (table.floats("x"), table.integers("offset_ns"));
                }
            }
        }
    }
}

#[test]
fn dictionaries_are_refused() {
    let names: DictionaryArray<Int8Type> = ["car", "bus", "car"].into_iter().collect();
    let columns = vec![("class", Arc::new(names) as ArrayRef), ("x", floats(vec![1.0; 3]))];
    let bytes = file(&[batch(columns)], None);
    let e = FeatherTable::parse(Path::new("f.feather"), &bytes, &["x"]).err().unwrap();
    assert_eq!(
        e.to_string(),
        "f.feather: has dictionary-encoded columns: write them as plain columns"
    );
}

#[test]
fn excessive_unpacked_sizes_are_refused() {
    let zeros: ArrayRef = Arc::new(UInt8Array::from(vec![0; 100 << 20]));
    let batches = vec![batch(vec![("x", zeros)]); 3];
    let bytes = file(&batches, Some(CompressionType::ZSTD));
    assert!(bytes.len() < 100 << 10, "{} bytes", bytes.len());
    let refused = |columns: &[&str]| {
        FeatherTable::parse(Path::new("f.feather"), &bytes, columns).err().unwrap().to_string()
    };
    let (size, most) = (3 * (100 << 20) * 24u64, (16 << 20) + 64 * bytes.len());
    let wanted = format!("f.feather: unpacks to {size} bytes, at most {most} are read");
    assert_eq!((refused(&["x"]), refused(&[])), (wanted.clone(), wanted));
}

#[test]
fn rows_of_nothing_are_counted() {
    let wanted = |rows: usize, bytes: &[u8]| {
        let (size, most) = (24 * rows, (16 << 20) + 64 * bytes.len());
        format!("f.feather: unpacks to {size} bytes, at most {most} are read")
    };
    let nothing: ArrayRef = Arc::new(NullArray::new(1 << 30));
    let bytes = file(&[batch(vec![("x", nothing)])], None);
    let e = FeatherTable::parse(Path::new("f.feather"), &bytes, &["x"]).err().unwrap().to_string();
    assert_eq!(e, wanted(1 << 30, &bytes));
    let bits: ArrayRef = Arc::new(BooleanArray::from(vec![false; 1 << 25]));
    let bytes = file(&vec![batch(vec![("x", bits)]); 2], Some(CompressionType::ZSTD));
    let e = FeatherTable::parse(Path::new("f.feather"), &bytes, &["x"]).err().unwrap().to_string();
    assert_eq!(e, wanted(1 << 26, &bytes));
}

#[test]
fn booleans_and_small_integers() {
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("classes", Arc::new(Int8Array::from(vec![-1, 29]))),
        ("valid", Arc::new(BooleanArray::from(vec![true, false]))),
        ("holey", Arc::new(BooleanArray::from(vec![Some(true), None]))),
    ];
    let bytes = file(&[batch(columns)], None);
    let table = FeatherTable::parse(Path::new("f.feather"), &bytes, &["classes", "valid", "holey"])
        .unwrap();
    assert_eq!(table.integers("classes").unwrap(), [-1, 29]);
    assert_eq!(table.booleans("valid").unwrap(), [true, false]);
    let refused = |name| table.booleans(name).unwrap_err().to_string();
    assert_eq!(refused("holey"), "f.feather, row 1: column `holey` is null or out of range");
    assert_eq!(refused("classes"), "f.feather: column `classes` is Int8, not booleans");
}

#[test]
fn own_poses_only() {
    let t = log();
    let options = OpenOptions { poses: Some("p.txt".into()), ..OpenOptions::default() };
    assert!(refused_with(t.path(), &options).contains("--poses does not apply"));
}

#[test]
fn lasers_are_distinguished_by_elevation() {
    // Laser 0 is the lower scanner's, at 3 degrees, laser 33 the upper one's, at -2 degrees.
    let t = log();
    let (mut x, mut y, mut z, mut lasers) = (vec![], vec![], vec![], vec![]);
    for (laser, elevation) in [(0u8, 3.0f32), (33, -2.0)] {
        for step in 0..60 {
            let azimuth = step as f32 * 0.1;
            let (range, e) = (8.0 + (step % 7) as f32 * 3.0, elevation.to_radians());
            // Scanners as in the calibration: up at x = 1, down at x = 2, both at z = 1.6.
            let at = if laser < 32 { 2.0 } else { 1.0 };
            x.push(half(at + range * e.cos() * azimuth.cos()));
            y.push(half(range * e.cos() * azimuth.sin()));
            z.push(half(1.6 + range * e.sin()));
            lasers.push(laser);
        }
    }
    let n = lasers.len();
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("x", Arc::new(Float16Array::from(x))),
        ("y", Arc::new(Float16Array::from(y))),
        ("z", Arc::new(Float16Array::from(z))),
        ("intensity", Arc::new(UInt8Array::from(vec![0; n]))),
        ("laser_number", Arc::new(UInt8Array::from(lasers))),
        ("offset_ns", Arc::new(Int32Array::from(vec![0; n]))),
    ];
    t.write(FIRST, file(&[batch(columns)], None));
    let mut source = opened(t.path());
    assert!(source.notes()[0].contains("lower scanner's"), "{:?}", source.notes());
    assert_eq!(read(source.as_mut(), 0).unwrap().points[0].sensor, 1);
}
