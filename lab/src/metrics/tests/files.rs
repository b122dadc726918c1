//! A log of three sweeps with truth, estimates and a map, and what can be wrong with them.

use super::*;
use crate::scratch::Scratch;
use argoverse::{Log, read_estimate};
use arrow_array::{
    ArrayRef, BooleanArray, Float32Array, Float64Array, Int8Array, Int32Array, Int64Array,
    RecordBatch, StringArray, UInt8Array,
};
use arrow_ipc::writer::FileWriter;
use clap::Parser;
use std::fs;
use std::path::Path;
use std::sync::Arc;

const STAMPS: [i64; 3] = [1_000_000_000, 1_100_000_000, 1_200_000_000];

/// A folder of logs.
struct Logs(Scratch);

impl Logs {
    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        self.0.write(name, content);
    }

    fn feather(&self, name: &str, columns: Vec<(&str, ArrayRef)>) {
        let batch = RecordBatch::try_from_iter(columns).unwrap();
        let mut writer = FileWriter::try_new(Vec::new(), &batch.schema()).unwrap();
        writer.write(&batch).unwrap();
        self.write(name, writer.into_inner().unwrap());
    }

    fn open(&self) -> Result<Log, String> {
        Log::open(&self.0.path().join("val/log"), None, true).map_err(|e| e.to_string())
    }

    /// The command's response to an estimate in `folder`.
    fn grade(&self, folder: &str) -> String {
        #[derive(Parser)]
        struct Command {
            #[command(flatten)]
            args: grade::Args,
        }
        let (log, folder) = (self.0.path().join("val/log"), self.0.path().join(folder));
        let words = ["grade".as_ref(), log.as_os_str(), "--estimate".as_ref(), folder.as_os_str()];
        match grade::run(&Command::parse_from(words).args) {
            Ok(()) => String::new(),
            Err(e) => e.to_string(),
        }
    }
}

fn f32s(values: &[f32]) -> ArrayRef {
    Arc::new(Float32Array::from(values.to_vec()))
}

fn f64s(values: &[f64]) -> ArrayRef {
    Arc::new(Float64Array::from(values.to_vec()))
}

/// The columns of poses at these `x`, without rotation, 10 m above the city's zero.
fn poses<'a>(x: &[f64]) -> Vec<(&'a str, ArrayRef)> {
    let all = |v: f64| f64s(&vec![v; x.len()]);
    let mut columns = vec![("qw", all(1.0)), ("qx", all(0.0)), ("qy", all(0.0)), ("qz", all(0.0))];
    columns.extend([("tx_m", f64s(x)), ("ty_m", all(0.0)), ("tz_m", all(10.0))]);
    columns
}

/// Flow of three returns along x.
fn flow<'a>(x: &[f32], valid: &[bool]) -> Vec<(&'a str, ArrayRef)> {
    let zero = f32s(&vec![0.0; x.len()]);
    vec![
        ("flow_tx_m", f32s(x)),
        ("flow_ty_m", zero.clone()),
        ("flow_tz_m", zero),
        ("is_valid", Arc::new(BooleanArray::from(valid.to_vec()))),
    ]
}

fn truth<'a>(x: &[f32], classes: &[i8]) -> Vec<(&'a str, ArrayRef)> {
    let mut columns = flow(x, &vec![true; x.len()]);
    columns.push(("classes_0", Arc::new(Int8Array::from(classes.to_vec()))));
    columns
}

/// Returns 1 m above the map's ground, 0.375 m above it, and where it has a hole.
fn log() -> Logs {
    let t = Logs(Scratch::new());
    for stamp in STAMPS {
        let sweep = vec![
            ("x", f32s(&[5.0, 6.0, 7.0])),
            ("y", f32s(&[0.0, 0.0, 1.0])),
            ("z", f32s(&[1.0, 0.375, 0.0])),
            ("intensity", Arc::new(UInt8Array::from(vec![0; 3])) as ArrayRef),
            ("laser_number", Arc::new(UInt8Array::from(vec![0; 3]))),
            ("offset_ns", Arc::new(Int32Array::from(vec![0; 3]))),
        ];
        t.feather(&format!("val/log/sensors/lidar/{stamp}.feather"), sweep);
    }
    let mut city = poses(&[0.0, 1.0, 2.0]);
    city.insert(0, ("timestamp_ns", Arc::new(Int64Array::from(STAMPS.to_vec()))));
    t.feather("val/log/city_SE3_egovehicle.feather", city);
    let mut scanners = poses(&[0.0, 0.0]);
    let names = Arc::new(StringArray::from(vec!["up_lidar", "down_lidar"]));
    scanners.insert(0, ("sensor_name", names));
    t.feather("val/log/calibration/egovehicle_SE3_sensor.feather", scanners);
    // Cells of 0.5 m from x = 4, y = 0 on: heights of 10 m in two rows, holes in the third.
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 8), }";
    let heights = [[10.0f32; 8], [10.0; 8], [f32::NAN; 8]];
    let data: Vec<u8> = heights.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let length = (header.len() as u16).to_le_bytes();
    let npy = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), &data].concat();
    t.write("val/log/map/log_ground_height_surface____X.npy", npy);
    let sim = r#"{"R": [1.0, 0.0, 0.0, 1.0], "t": [-4.0, 0.0], "s": 2.0}"#;
    t.write("val/log/map/log___img_Sim2_city.json", sim);
    for stamp in &STAMPS[..2] {
        let name = format!("val_sceneflow_feather/log/{stamp}.feather");
        t.feather(&name, truth(&[0.5, 0.0, 0.0], &[18, -1, -1]));
        t.feather(&format!("out/log/{stamp}.feather"), flow(&[0.25, 0.0, 0.0], &[true; 3]));
    }
    t
}

const TRUTH: &str = "val_sceneflow_feather/log/1000000000.feather";
const ESTIMATE: &str = "out/log/1000000000.feather";

#[test]
fn a_pair() {
    let t = log();
    let mut log = t.open().unwrap();
    assert_eq!((log.name(), log.pairs().count()), ("log", 2));
    // In any order: cached sweeps are identified correctly.
    for sweep in [1, 0, 1, 0, 0] {
        let pair = log.pair(sweep).unwrap();
        // A return 0.375 m above the ground belongs to it; where the map has a hole none does.
        assert_eq!(pair.points.iter().map(|p| p.ground).collect::<Vec<_>>(), [false, true, false]);
        assert_eq!(pair.points[0].category.class(), Some(Class::Car));
        assert_eq!(pair.points[0].flow_m, [0.5, 0.0, 0.0]);
        assert!((pair.second_from_first.translation.x + 1.0).abs() < 1e-12);
        let estimate =
            read_estimate(&log.estimates(&t.0.path().join("out")).unwrap()[&sweep], &pair);
        let scored = score(&pair, &estimate.unwrap().flow_m);
        assert_eq!(scored.iter().map(|s| s.error_m).collect::<Vec<_>>(), [0.25, 0.0]);
    }
    assert_eq!(t.grade("out"), "");
    let without =
        Log::open(&t.0.path().join("val"), Some(&t.0.path().join("val_sceneflow_feather")), false);
    assert!(without.unwrap().pair(0).unwrap().points.iter().all(|p| !p.ground));
}

/// Ground is decided by height above the map: up to 0.4 m, and everything below.
#[test]
fn ground() {
    let t = log();
    let ground = ground::Ground::read(&t.0.path().join("val/log")).unwrap();
    let at = |x: f64, y: f64, z: f64| ground.holds(glam::DVec3::new(x, y, z));
    let holds = |x, z| at(x, 0.0, z);
    assert!(holds(4.0, 10.4 - 1e-9) && !holds(4.0, 10.41) && holds(4.0, -99.0));
    // Places are rounded, halves to the even cell: cell -0.5 is 0, cell 7.5 is 8 and beyond.
    assert!(holds(3.75, 10.0) && !holds(3.74, 10.0));
    assert!(holds(7.74, 10.0) && !holds(7.75, 10.0));
    assert!(at(4.0, 0.74, 10.0) && !at(4.0, 0.75, 10.0) && !at(4.0, -0.26, 10.0));
    assert!(!holds(f64::NAN, 10.0) && !holds(4.0, f64::NAN));
}

#[test]
fn by_name_or_by_order() {
    let t = log();
    // One pair of the truth is missing: the other keeps its index, unlike in the grader.
    fs::remove_file(t.0.path().join(TRUTH)).unwrap();
    assert_eq!(t.open().unwrap().pairs().next().unwrap().0, 1);
    assert_eq!(t.grade("out"), "");
    // Names that are not stamps count by order; other files are ignored.
    t.feather("count/log/0000000000.feather", flow(&[0.0; 3], &[true; 3]));
    t.write("count/log/0000000000_occ.feather", "");
    assert!(t.grade("count").contains("count/log: has no estimate of sweep 1100000000, but "));
    t.feather("count/log/0000000001.feather", flow(&[0.0; 3], &[true; 3]));
    assert_eq!(t.grade("count"), "");
    t.feather("count/log/0000000002.feather", flow(&[0.0; 3], &[true; 3]));
    assert!(t.grade("count").contains("0000000002.feather: holds flow from sweep 2"));
    t.feather("count/log/1000000000.feather", flow(&[0.0; 3], &[true; 3]));
    assert!(t.grade("count").contains("some names are stamps"));
    t.feather("twice/log/1.feather", flow(&[0.0; 3], &[true; 3]));
    t.feather("twice/log/01.feather", flow(&[0.0; 3], &[true; 3]));
    assert!(t.grade("twice").contains("two names denote the same number"));
}

#[test]
fn wrong_estimates() {
    let t = log();
    let grade = |columns| {
        t.feather(ESTIMATE, columns);
        let text = t.grade("out");
        assert!(text.contains("out/log/1000000000.feather: "), "{text}");
        text
    };
    assert!(grade(flow(&[0.0; 2], &[true; 2])).ends_with("2 rows, but the sweep has 3 returns"));
    let nan = grade(flow(&[f32::NAN, 0.0, 0.0], &[true; 3]));
    assert!(nan.ends_with("row 0: the estimated flow is not finite"), "{nan}");
    assert!(grade(flow(&[0.0; 3], &[true; 3])[..3].to_vec()).contains("no column `is_valid`"));
    let mut columns = flow(&[0.0; 3], &[true; 3]);
    columns[3].1 = f32s(&[1.0; 3]);
    assert!(grade(columns).contains("column `is_valid` is Float32, not booleans"));
    let mut columns = flow(&[0.0; 3], &[true; 3]);
    columns[3].1 = Arc::new(BooleanArray::from(vec![Some(true), None, Some(true)]));
    t.feather(ESTIMATE, columns);
    assert!(t.grade("out").contains("1000000000.feather, row 1: column `is_valid` is null"));
    // A return on the ground does not count; one that is not valid still does.
    t.feather(ESTIMATE, flow(&[0.0, f32::NAN, 0.0], &[false; 3]));
    assert_eq!(t.grade("out"), "");
    let mut log = t.open().unwrap();
    let pair = log.pair(0).unwrap();
    let estimate = read_estimate(&t.0.path().join(ESTIMATE), &pair).unwrap();
    assert_eq!(estimate.marked_invalid(&pair, &Rules::OFFICIAL), 2);
}

#[test]
fn truncated_or_missing() {
    let t = log();
    let whole = fs::read(t.0.path().join(ESTIMATE)).unwrap();
    for cut in (0..whole.len()).step_by(97) {
        t.write(ESTIMATE, &whole[..cut]);
        let text = t.grade("out");
        assert!(text.contains("out/log/1000000000.feather: "), "{text}");
    }
    assert!(t.grade("nowhere").contains("cannot read"));
    fs::create_dir_all(t.0.path().join("empty/log")).unwrap();
    assert!(t.grade("empty").contains("empty/log: no flow"));
}

#[test]
fn wrong_truth() {
    let t = log();
    let pair = |columns| {
        t.feather(TRUTH, columns);
        t.open().unwrap().pair(0).unwrap_err().to_string()
    };
    assert!(pair(truth(&[0.0; 4], &[0; 4])).contains("4 rows, but the sweep has 3 returns"));
    let text = pair(truth(&[0.0; 3], &[0, 30, 0]));
    assert!(text.contains("1000000000.feather, row 1: classes_0 30 is not in"), "{text}");
    assert!(pair(flow(&[0.0; 3], &[true; 3])).contains("has no column `classes_0`"));
    // NaN that counts is reported with the truth's file, whatever is graded.
    t.feather(TRUTH, truth(&[f32::NAN, 0.0, 0.0], &[18, -1, -1]));
    let text = t.grade("out");
    assert!(text.contains("val_sceneflow_feather/log/1000000000.feather: row 0: the true"));
    fs::remove_dir_all(t.0.path().join("val_sceneflow_feather")).unwrap();
    assert!(t.grade("out").contains("cannot read"));
}

#[test]
fn wrong_maps() {
    let t = log();
    let refused = || t.open().err().unwrap();
    let sim = "val/log/map/log___img_Sim2_city.json";
    for text in ["{}", r#"{"R": [1, 0, 0, 1], "t": [0, 0], "s": 0}"#, r#"{"R": [1, 0], "t""#] {
        t.write(sim, text);
        assert!(refused().contains("img_Sim2_city.json: "), "{}", refused());
    }
    fs::remove_file(t.0.path().join(sim)).unwrap();
    assert!(refused().contains("map: lacks a Sim2"));
    t.write("val/log/map/log_ground_height_surface____X.npy", "PK");
    assert!(refused().contains("X.npy: is not a NumPy file"));
    t.write("val/log/map/log_ground_height_surface____Y.npy", "");
    assert!(refused().contains("map: holds 2 files that could be a height raster"));
    fs::remove_dir_all(t.0.path().join("val/log/map")).unwrap();
    assert!(refused().contains("cannot read"));
    let elsewhere = Log::open(Path::new("/nowhere"), None, true);
    assert!(elsewhere.err().unwrap().to_string().contains("cannot read /nowhere"));
}
