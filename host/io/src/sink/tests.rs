//! What sinks write is read back.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use raywake_core::output::{ColumnFlow, Origin};
use raywake_core::sweep::Point;

use super::{atomic, picture};
use crate::source::tests::Temp;

fn names(folder: &Path) -> Vec<String> {
    let list = fs::read_dir(folder).unwrap();
    list.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn a_file_is_whole_or_absent() {
    let t = Temp::new();
    let path = t.path().join("a.txt");
    atomic::write(&path, |w| w.write_all(b"one")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"one");
    // A failure leaves what was there, and nothing else.
    let e = atomic::write(&path, |w| {
        w.write_all(b"two")?;
        assert_eq!(names(t.path()).len(), 2);
        Err(io::Error::from(io::ErrorKind::StorageFull))
    })
    .unwrap_err();
    assert!(e.to_string().contains("a.txt: no storage space"), "{e}");
    assert_eq!(e.exit_code(), 4);
    assert_eq!(
        (fs::read(&path).unwrap(), names(t.path())),
        (b"one".to_vec(), vec!["a.txt".into()])
    );
    let absent = t.path().join("no/such/folder/a.txt");
    assert!(atomic::write(&absent, |_| Ok(())).unwrap_err().to_string().contains("folder/a.txt"));
    assert!(atomic::write(Path::new("/"), |_| Ok(())).is_err());
    // A folder has the name already.
    assert!(atomic::write(&t.path().join("."), |_| Ok(())).is_err());
    let folder = t.path().join("folder/f");
    atomic::create_folder(&folder).unwrap();
    assert!(atomic::write(folder.parent().unwrap(), |_| Ok(())).is_err());
    assert!(!names(t.path()).iter().any(|n| n.ends_with(".partial")));
    assert!(atomic::create_folder(&path).is_err());
}

#[test]
fn arrows_point_where_things_go() {
    let point = |x, y, z| Point { position: [x, y, z], ..Point::default() };
    let points: Vec<Point> = (0..100).map(|i| point(i as f32 * 0.1, 8.0, -1.7)).collect();
    let column = ColumnFlow {
        position_vehicle_m: [10.0, 0.0],
        velocity_world_mps: [10.0, 0.0],
        velocity_ego_mps: [0.0, -10.0],
        origin: Origin::Matched,
        age: 3,
        ..ColumnFlow::default()
    };
    // Too young to be drawn.
    let young = ColumnFlow { position_vehicle_m: [-10.0, 0.0], age: 2, ..column };
    let red = |velocity| {
        let rgb = picture::birdseye(&points, &[column, young], 30.0, velocity);
        assert_eq!(rgb.len(), 3 * picture::SIZE * picture::SIZE);
        let is_red = |p: &[u8]| p[0].saturating_sub(p[1]) > 40 && p[0] > p[2];
        let pixels = rgb.chunks_exact(3).enumerate().filter(|(_, p)| is_red(p));
        let places = pixels.map(|(i, _)| ((i % picture::SIZE) as f64, (i / picture::SIZE) as f64));
        let (mut n, mut x, mut y) = (0.0, 0.0, 0.0);
        for (u, v) in places {
            (n, x, y) = (n + 1.0, x + u, y + v);
        }
        assert!(n > 50.0);
        // Metres to the left and forward of the vehicle.
        ((450.0 - x / n) / 15.0, (450.0 - y / n) / 15.0)
    };
    let (left, forward) = red(picture::Velocity::Ego);
    assert!(left < -1.0 && (forward - 10.0).abs() < 0.3, "{left} {forward}");
    // The vehicle heads along world y: world x is to its right.
    let heading = picture::Velocity::World { vehicle_yaw_rad: core::f64::consts::FRAC_PI_2 };
    let (left, forward) = red(heading);
    assert!(left < -1.0 && (forward - 10.0).abs() < 0.3, "{left} {forward}");
    let (left, forward) = red(picture::Velocity::World { vehicle_yaw_rad: 0.0 });
    assert!(left.abs() < 0.3 && forward > 11.0, "{left} {forward}");
}

#[test]
fn pictures_bear_nonsense() {
    let point = |v| Point { position: [v; 3], ..Point::default() };
    let points = [point(f32::NAN), point(f32::INFINITY), point(1e30), point(-1e30)];
    let column = |v| ColumnFlow {
        velocity_ego_mps: [v; 2],
        origin: Origin::Matched,
        age: 9,
        ..ColumnFlow::default()
    };
    let columns = [column(f32::NAN), column(1e30), column(f32::INFINITY)];
    for extent in [f32::NAN, 0.0, 50.0, 1e9] {
        picture::birdseye(&points, &columns, extent, picture::Velocity::Ego);
    }
}

#[cfg(feature = "png")]
#[test]
fn a_picture_is_a_png() {
    let t = Temp::new();
    let path = t.path().join("p.png");
    let rgb = picture::birdseye(&[], &[], 40.0, picture::Velocity::Ego);
    picture::write_png(&path, &rgb).unwrap();
    let decoder = png::Decoder::new(io::BufReader::new(fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut back = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut back).unwrap();
    assert_eq!(back, rgb);
    assert!(picture::write_png(&path, &rgb[1..]).is_err());
    assert_eq!(names(t.path()), ["p.png"]);
}

#[cfg(feature = "arrow")]
mod tables {
    use super::*;
    use crate::sink::{argoverse, feather};
    use arrow_array::RecordBatch;
    use arrow_array::cast::AsArray;
    use arrow_array::types::{Float32Type, Float64Type, Int32Type, UInt32Type};
    use arrow_ipc::reader::FileReader;
    use raywake_core::output::{PointFlow, TrackletState};
    use raywake_core::pose::Pose;

    fn back(path: &Path) -> RecordBatch {
        let mut reader = FileReader::try_new(fs::File::open(path).unwrap(), None).unwrap();
        reader.next().unwrap().unwrap()
    }

    fn f32s(batch: &RecordBatch, name: &str) -> Vec<f32> {
        batch.column_by_name(name).unwrap().as_primitive::<Float32Type>().values().to_vec()
    }

    fn bools(batch: &RecordBatch, name: &str) -> Vec<bool> {
        batch.column_by_name(name).unwrap().as_boolean().values().iter().collect()
    }

    #[test]
    fn columns() {
        let t = Temp::new();
        let path = t.path().join("c.feather");
        let flow = ColumnFlow {
            cell: [-3, 7],
            position_world_m: [1e6 + 0.125, 2.0],
            velocity_world_mps: [1.5, -2.5],
            covariance: [0.1, 0.2, 0.3],
            age: 9,
            origin: Origin::Unmatched,
            ..ColumnFlow::default()
        };
        let rows = [flow, ColumnFlow { origin: Origin::Matched, ..flow }, ColumnFlow::default()];
        feather::write_columns(&path, &rows, &[("frame", "17".into())]).unwrap();
        let b = back(&path);
        let cells = b.column_by_name("cell_i").unwrap().as_primitive::<Int32Type>();
        assert_eq!(cells.values(), &[-3, -3, 0]);
        let x = b.column_by_name("x_world_m").unwrap().as_primitive::<Float64Type>();
        assert_eq!(x.value(0), 1e6 + 0.125);
        assert_eq!(f32s(&b, "vy_world_mps"), [-2.5, -2.5, 0.0]);
        assert_eq!(f32s(&b, "cov_yy"), [0.3, 0.3, 0.0]);
        let age = b.column_by_name("age").unwrap().as_primitive::<UInt32Type>();
        assert_eq!(age.values(), &[9, 9, 0]);
        assert_eq!(bools(&b, "foreground"), [true, true, false]);
        assert_eq!(bools(&b, "valid"), [false, true, false]);
        let schema = b.schema();
        assert_eq!(schema.metadata["frame"], "17");
        assert_eq!(schema.metadata["raywake"], env!("CARGO_PKG_VERSION"));
        feather::write_columns(&path, &[], &[]).unwrap();
        assert_eq!(names(t.path()), ["c.feather"]);
    }

    #[test]
    fn points_tracklets_and_map() {
        let t = Temp::new();
        let path = t.path().join("p.feather");
        let (points, flows) = ([Point::default(); 2], [PointFlow::default(); 2]);
        feather::write_points(&path, &points, &flows, &[]).unwrap();
        assert_eq!(back(&path).num_rows(), 2);
        assert!(feather::write_points(&path, &points, &flows[1..], &[]).is_err());
        let mut state = TrackletState { speed_mps: 4.0, ..TrackletState::default() };
        state.covariance[3][4] = 0.5;
        feather::write_tracklets(&path, &[state], &[]).unwrap();
        let b = back(&path);
        assert_eq!((f32s(&b, "speed_mps"), f32s(&b, "cov_speed_turn")), (vec![4.0], vec![0.5]));
        let of_cov = |f: &&std::sync::Arc<arrow_schema::Field>| f.name().starts_with("cov_");
        assert_eq!(b.schema().fields().iter().filter(of_cov).count(), 15);
        let voxel = feather::Voxel { index: [1, 2, -3], log_odds_tenths: -35 };
        feather::write_map(&path, &[voxel], [1.0, 2.0, 3.0], 0.3, &[]).unwrap();
        let b = back(&path);
        assert_eq!(f32s(&b, "log_odds"), [-3.5]);
        assert_eq!(b.schema().metadata["origin_y_m"], "2");
        assert_eq!(b.schema().metadata["resolution_m"], "0.3");
        let absent = t.path().join("no/p.feather");
        assert_eq!(feather::write_columns(&absent, &[], &[]).unwrap_err().exit_code(), 4);
    }

    #[test]
    fn argoverse_export() {
        let t = Temp::new();
        let flow =
            |x, origin| PointFlow { velocity_world_mps: [x, 0.0], origin, ..PointFlow::default() };
        let flows = [flow(10.0, Origin::Matched), flow(0.0, Origin::Unmatched)];
        let pose = Pose::planar(5.0, 5.0, 0.0, core::f64::consts::PI);
        let path = argoverse::export(t.path(), "log", 123, &flows, &pose, 0.1).unwrap();
        assert!(path.ends_with("log/123.feather"));
        let b = back(&path);
        assert!((f32s(&b, "flow_tx_m")[0] + 1.0).abs() < 1e-6);
        assert_eq!(bools(&b, "is_valid"), [true, false]);
        assert_eq!(b.num_columns(), 4);
        assert!(argoverse::export(t.path(), "../x", 1, &flows, &pose, 0.1).is_err());
    }
}
