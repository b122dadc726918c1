//! Reads back what sinks write.

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use super::atomic;
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
    // A folder already has the name.
    assert!(atomic::write(&t.path().join("."), |_| Ok(())).is_err());
    let folder = t.path().join("folder/f");
    atomic::create_folder(&folder).unwrap();
    assert!(atomic::write(folder.parent().unwrap(), |_| Ok(())).is_err());
    assert!(!names(t.path()).iter().any(|n| n.ends_with(".partial")));
    assert!(atomic::create_folder(&path).is_err());
}

#[test]
fn stale_files_are_removed_and_files_being_written_are_not() {
    let t = Temp::new();
    let path = t.path().join("a.txt");
    t.write(".a.txt.partial", "left");
    atomic::write(&path, |w| w.write_all(b"one")).unwrap();
    assert_eq!((fs::read(&path).unwrap(), names(t.path()).len()), (b"one".to_vec(), 1));
    let (partial, mut writer) = atomic::Partial::create(&path).unwrap();
    let e = atomic::write(&path, |w| w.write_all(b"two")).unwrap_err();
    assert!(e.to_string().ends_with("a.txt: another process is writing it"), "{e}");
    writer.write_all(b"three").and_then(|()| writer.flush()).unwrap();
    partial.keep().unwrap();
    assert_eq!((fs::read(&path).unwrap(), names(t.path()).len()), (b"three".to_vec(), 1));
}

#[cfg(unix)]
#[test]
fn a_planted_link_is_not_followed() {
    let t = Temp::new();
    let target = t.write("target", "precious");
    std::os::unix::fs::symlink(&target, t.path().join(".a.txt.partial")).unwrap();
    atomic::write(&t.path().join("a.txt"), |w| w.write_all(b"one")).unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"precious");
    assert_eq!(fs::read(t.path().join("a.txt")).unwrap(), b"one");
}

#[cfg(unix)]
#[test]
fn a_planted_pipe_does_not_block() {
    let t = Temp::new();
    let pipe = t.path().join(".a.txt.partial");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let path = t.path().join("a.txt");
    let (tell, told) = std::sync::mpsc::channel();
    let to = path.clone();
    std::thread::spawn(move || tell.send(atomic::write(&to, |w| w.write_all(b"one"))));
    let written = told.recv_timeout(Duration::from_secs(60));
    written.expect("the other end of the pipe is not waited for").unwrap();
    assert_eq!((fs::read(&path).unwrap(), names(t.path()).len()), (b"one".to_vec(), 1));
}

#[test]
fn writers_of_one_file_leave_each_other_alone() {
    let t = Temp::new();
    let path = t.path().join("a.txt");
    let write = || {
        for _ in 0..300 {
            if let Err(e) = atomic::write(&path, |w| w.write_all(b"whole")) {
                assert!(e.to_string().contains("another process is writing it"), "{e}");
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(write);
        scope.spawn(write);
    });
    assert_eq!((fs::read(&path).unwrap(), names(t.path()).len()), (b"whole".to_vec(), 1));
}

#[test]
fn a_folder_has_one_writer() {
    let t = Temp::new();
    let folder = t.path().join("a/b");
    let claim = atomic::claim_folder(&folder).unwrap();
    let e = atomic::claim_folder(&folder).unwrap_err();
    assert!(e.to_string().contains("another process is writing results into it"), "{e}");
    drop(claim);
    atomic::claim_folder(&folder).unwrap();
}

#[cfg(feature = "arrow")]
mod tables {
    use super::*;
    use crate::sink::flow_tables::{FlowTables, SweepMark};
    use crate::sink::{argoverse, feather};
    use arrow_array::RecordBatch;
    use arrow_array::cast::AsArray;
    #[cfg(feature = "parquet")]
    use arrow_array::types::UInt64Type;
    use arrow_array::types::{Float32Type, Float64Type, Int32Type, UInt32Type};
    use arrow_ipc::reader::FileReader;
    use raywake_core::output::{ColumnFlow, FlowBasis, PointFlow, TrackletState};
    use raywake_core::pose::Pose;
    use raywake_core::sweep::Point;

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
            basis: FlowBasis::Unmatched,
            ..ColumnFlow::default()
        };
        let rows = [flow, ColumnFlow { basis: FlowBasis::Matched, ..flow }, ColumnFlow::default()];
        feather::columns(&rows).write(&path, &[("frame", "17".into())]).unwrap();
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
        feather::columns(&[]).write(&path, &[]).unwrap();
        assert_eq!(names(t.path()), ["c.feather"]);
    }

    #[test]
    fn points_tracklets_and_map() {
        let t = Temp::new();
        let path = t.path().join("p.feather");
        let (points, flows) = ([Point::default(); 2], [PointFlow::default(); 2]);
        feather::points(&points, &flows).write(&path, &[]).unwrap();
        assert_eq!(back(&path).num_rows(), 2);
        let mut state = TrackletState { speed_mps: 4.0, ..TrackletState::default() };
        state.covariance[3][4] = 0.5;
        feather::tracklets(&[state]).write(&path, &[]).unwrap();
        let b = back(&path);
        assert_eq!((f32s(&b, "speed_mps"), f32s(&b, "cov_speed_turn")), (vec![4.0], vec![0.5]));
        let of_cov = |f: &&std::sync::Arc<arrow_schema::Field>| f.name().starts_with("cov_");
        assert_eq!(b.schema().fields().iter().filter(of_cov).count(), 15);
        let voxel = feather::Voxel { index: [1, 2, -3], log_odds_tenths: -35 };
        feather::write_map(&path, &[voxel], [1.0, 2.0, 3.0], 0.3, 3.0, &[]).unwrap();
        let b = back(&path);
        assert_eq!(f32s(&b, "log_odds"), [-3.5]);
        assert!((f32s(&b, "probability")[0] - 0.0474).abs() < 1e-4);
        assert_eq!(b.schema().metadata["origin_y_m"], "2");
        assert_eq!(b.schema().metadata["resolution_m"], "0.3");
        let absent = t.path().join("no/p.feather");
        assert_eq!(feather::columns(&[]).write(&absent, &[]).unwrap_err().exit_code(), 4);
    }

    const MARK: SweepMark = SweepMark { frame: 7, stamp_s: 0.5, dt_s: 0.1 };

    #[test]
    fn results_of_an_interrupted_run_are_kept() {
        let t = Temp::new();
        let rows = [ColumnFlow { age: 3, ..ColumnFlow::default() }];
        let write = |frame, rows: &[ColumnFlow]| {
            let mut tables = FlowTables::folders(t.path(), false).unwrap();
            tables.columns(&SweepMark { frame, ..MARK }, rows)
        };
        write(7, &rows).unwrap();
        let path = t.path().join("columns/0000000007.feather");
        let time = || fs::metadata(&path).unwrap().modified().unwrap();
        let first = time();
        write(7, &rows).unwrap();
        assert_eq!(time(), first);
        let e = write(7, &[]).unwrap_err();
        assert!(e.to_string().contains("0000000007.feather differs from this run's result"), "{e}");
        assert_eq!((e.exit_code(), time()), (2, first));
        // Every table is compared, not just the first.
        let mut tables = FlowTables::folders(t.path(), false).unwrap();
        write(8, &rows).unwrap();
        tables.columns(&MARK, &rows).unwrap();
        assert!(tables.columns(&SweepMark { frame: 8, ..MARK }, &[]).is_err());
        assert!(!t.path().join("points").exists());
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn all_sweeps_in_one_file() {
        use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
        use raywake_core::output::Status;
        let t = Temp::new();
        let moving = PointFlow { status: Status::Moving, ..PointFlow::default() };
        let point = Point { position: [1.0, 2.0, 3.0], ..Point::default() };
        let mut tables = FlowTables::files(t.path());
        for frame in [7, 8] {
            let flows = [moving, PointFlow::default()];
            tables.points(&SweepMark { frame, ..MARK }, &[point; 2], &flows).unwrap();
        }
        assert_eq!(names(t.path()), [".points.parquet.partial"]);
        tables.finish().unwrap();
        assert_eq!(names(t.path()), ["points.parquet"]);
        let file = fs::File::open(t.path().join("points.parquet")).unwrap();
        let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
        assert_eq!(reader.metadata().num_row_groups(), 2);
        assert!(reader.schema().metadata()["status"].starts_with("static,moving"));
        let b = reader.build().unwrap().next().unwrap().unwrap();
        let frames = b.column_by_name("frame").unwrap().as_primitive::<UInt64Type>();
        assert_eq!(frames.values(), &[7, 7, 8, 8]);
        let y = b.column_by_name("y_m").unwrap().as_primitive::<Float32Type>();
        assert_eq!(y.iter().collect::<Vec<_>>(), [Some(2.0), None, Some(2.0), None]);
        // Without a table there is no file; a missing folder is an error that names the file.
        FlowTables::files(t.path()).finish().unwrap();
        let e = FlowTables::files(&t.path().join("no")).columns(&MARK, &[]).unwrap_err();
        assert!(e.to_string().contains("columns.parquet") && e.exit_code() == 4, "{e}");
    }

    #[test]
    fn argoverse_export() {
        let t = Temp::new();
        let flow =
            |x, basis| PointFlow { velocity_world_mps: [x, 0.0], basis, ..PointFlow::default() };
        let flows = [flow(10.0, FlowBasis::Matched), flow(0.0, FlowBasis::Unmatched)];
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
