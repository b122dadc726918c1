//! `raywake flow` from the user's side: clouds in, one row per point out.

#[allow(dead_code)]
mod common;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use common::{Outcome, Temp, raywake, row};
use glam::{DQuat, DVec3, EulerRot};
use raywake::order_statistics::median;
use raywake_core::pose::Pose;
use raywake_sim::{Drive, Options, Path as Track, Scene, SimSweep, State};

/// Rows without a position, inserted into the first cloud.
const BAD: [usize; 3] = [0, 1000, 40_000];

/// Two sweeps of a vehicle that turns left on a street, and the number of an oncoming car.
fn sweeps() -> &'static ([SimSweep; 2], u32) {
    static SWEEPS: OnceLock<([SimSweep; 2], u32)> = OnceLock::new();
    SWEEPS.get_or_init(|| {
        let mut scene = Scene::street(5);
        let against = State { x: 16.0, y: 3.5, yaw: std::f64::consts::PI, speed: 11.0 };
        let car = scene.add_car(Track::from(against), 1);
        let own = Track::from(State { speed: 9.0, ..State::default() }).then(5.0, 0.0, 0.03);
        let drive = Drive::through(scene, own, 1, Options { sweeps: 2, ..Options::default() });
        ([0, 1].map(|index| drive.sweep(index)), car)
    })
}

/// The pose of the second sweep's vehicle in the first one's.
fn ego_motion() -> Pose {
    let [first, second] = &sweeps().0;
    first.world_from_vehicle.inverse() * second.world_from_vehicle
}

/// Coordinates of a sweep's points.
fn positions(sweep: &SimSweep) -> Vec<[f32; 3]> {
    sweep.points.iter().map(|p| p.position).collect()
}

/// The first sweep with the rows without a position.
fn first_cloud() -> Vec<[f32; 3]> {
    let mut cloud = positions(&sweeps().0[0]);
    BAD.iter().for_each(|row| cloud.insert(*row, [1.0, f32::NAN, 0.0]));
    cloud
}

fn bin(cloud: &[[f32; 3]]) -> Vec<u8> {
    let rows = cloud.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.5]);
    rows.flat_map(f32::to_le_bytes).collect()
}

fn pcd(cloud: &[[f32; 3]]) -> Vec<u8> {
    let count = cloud.len();
    let head = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    );
    head.into_bytes()
        .into_iter()
        .chain(cloud.iter().flatten().flat_map(|v| v.to_le_bytes()))
        .collect()
}

fn flow(a: &Path, b: &Path, out: &Path, more: &[&str]) -> Outcome {
    let [a, b, out] = [a, b, out].map(|p| p.to_str().unwrap());
    raywake(&[&["flow", a, b, "--out", out, "--backend", "scalar"], more].concat())
}

/// Flow and motion of every row of a `.bin`.
fn rows(path: &Path) -> Vec<[DVec3; 2]> {
    let bytes = std::fs::read(path).unwrap();
    let (words, rest) = bytes.as_chunks::<4>();
    assert!(rest.is_empty());
    let numbers: Vec<f64> = words.iter().map(|w| f64::from(f32::from_le_bytes(*w))).collect();
    let (rows, rest) = numbers.as_chunks::<6>();
    assert!(rest.is_empty());
    rows.iter().map(|r| [DVec3::from_slice(&r[..3]), DVec3::from_slice(&r[3..])]).collect()
}

/// The printed motion.
fn printed(o: &Outcome) -> Pose {
    let line = o.stdout.lines().find(|l| l.starts_with("motion")).unwrap();
    let words = line.split([' ', ',']).filter_map(|w| w.parse().ok());
    let n: Vec<f64> = words.collect();
    let [roll, pitch, yaw] = [n[3], n[4], n[5]].map(f64::to_radians);
    let rotation = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
    Pose::new(rotation, DVec3::new(n[0], n[1], n[2]))
}

#[test]
fn a_moving_vehicle_and_an_oncoming_car() {
    let t = Temp::new();
    let ([first, second], car) = sweeps();
    let cloud = first_cloud();
    let (a, b) = (t.write("a.pcd", pcd(&cloud)), t.write("b.bin", bin(&positions(second))));
    let out = t.path().join("flow.bin");
    let o = flow(&a, &b, &out, &[]);
    o.succeeded();
    for word in ["ground     at -1.7", "overlap", "points: ", "times", "3 not finite"] {
        assert!(o.stdout.contains(word), "{word} in {}", o.stdout);
    }
    let (truth, found) = (ego_motion(), printed(&o));
    let off = (truth.inverse() * found).twist(1.0);
    let (metres, degrees) = (off.linear.length(), off.angular.length().to_degrees());
    assert!(metres < 0.02 && degrees < 0.1, "{metres} m, {degrees} degrees: {}", o.stdout);

    let rows = rows(&out);
    assert_eq!(rows.len(), cloud.len());
    for (row, ([flow, motion], at)) in rows.iter().zip(&cloud).enumerate() {
        if BAD.contains(&row) {
            assert!(flow.is_nan() && motion.is_nan(), "row {row}");
            continue;
        }
        let at = DVec3::from_array(at.map(f64::from));
        let expected = found.inverse().transform(at + *motion) - at;
        assert!((expected - *flow).length() < 0.02, "row {row}: {flow} {expected}");
    }
    // The inserted rows have no ground truth.
    let mut measured = rows;
    for row in BAD.iter().rev() {
        measured.remove(*row);
    }
    let vehicle_from_world = first.world_from_vehicle.rotation.conjugate();
    let (mut errors, mut still) = (Vec::new(), 0);
    for ([_, motion], truth) in measured.iter().zip(&first.truth) {
        let moved = vehicle_from_world * glam::Vec3::from_array(truth.flow_world).as_dvec3();
        if truth.object == *car {
            assert!((moved.length() - 1.1).abs() < 0.05, "{moved}");
            errors.push((*motion - moved).length());
        }
        still += usize::from(truth.object == 0 && motion.length() < 0.05);
    }
    assert!(errors.len() > 300, "{} points", errors.len());
    let error = median(errors);
    assert!(error < 0.3, "{error} m");
    let background = first.truth.iter().filter(|t| t.object == 0).count();
    assert!(5 * still > 4 * background, "{still} of {background} stand");
}

#[test]
fn far_apart_and_turned() {
    let t = Temp::new();
    let cloud = positions(&sweeps().0[0]);
    let apart = Pose::planar(6.0, -0.8, 0.0, 0.2);
    let moved = |p: &[f32; 3]| {
        let at = apart.inverse().transform(DVec3::from_array(p.map(f64::from)));
        at.as_vec3().to_array()
    };
    let a = t.write("a.bin", bin(&cloud));
    let b = t.write("b.bin", bin(&cloud.iter().map(moved).collect::<Vec<_>>()));
    let o = flow(&a, &b, &t.path().join("f.bin"), &["--dt", "0.5"]);
    o.succeeded();
    let off = (apart.inverse() * printed(&o)).twist(1.0);
    assert!(off.linear.length() < 0.01 && off.angular.length() < 1e-3, "{}", o.stdout);
    // Too much motion for a vehicle in 0.05 s.
    let o = flow(&a, &b, &t.path().join("f.bin"), &["--dt", "0.05"]);
    o.failed(2, &["b.bin does not follow", "jump at 121 m/s"]);
    flow(&a, &b, &t.path().join("f.bin"), &["--dt", "2"]).failed(2, &["gap of 2.000 s"]);
}

#[test]
fn known_motion_is_used() {
    let t = Temp::new();
    let [first, second] = &sweeps().0;
    let (a, b) =
        (t.write("a.bin", bin(&positions(first))), t.write("b.bin", bin(&positions(second))));
    let out = t.path().join("flow.bin");
    let pose = t.write("pose.txt", "1 0 0 0.5 0 1 0 0.25 0 0 1 0\n");
    let pose = pose.to_str().unwrap();
    let more = ["--pose", pose, "--ground", "-1.73", "--sensor", "0.0,0,-0.1", "--filter", "none"];
    let o = flow(&a, &b, &out, &[&more[..], &["--profile", "wide"]].concat());
    o.succeeded();
    for word in ["x 0.500, y 0.250", "(given)", "(0.00, 0.00, -0.10)", "-1.73 m (given)"] {
        assert!(o.stdout.contains(word), "{word} in {}", o.stdout);
    }
    assert!(flow(&a, &b, &out, &["--quiet", "--pose", pose]).stdout.is_empty());
    let still = rows(&out).iter().filter(|r| r[0] == DVec3::new(-0.5, -0.25, 0.0)).count();
    assert!(still > 10_000, "{still}");
    let two = t.write("two.txt", [row(0.0), row(1.0)].concat());
    flow(&a, &b, &out, &["--pose", two.to_str().unwrap()]).failed(3, &["two.txt", "2 poses"]);
    flow(&a, &b, &out, &["--pose", "absent.txt"]).failed(3, &["absent.txt"]);
    flow(&a, &b, &out, &["--ground", "nan"]).failed(2, &["ground"]);
    flow(&a, &b, &out, &["--sensor", "1,2"]).failed(2, &["X,Y,Z"]);
    flow(&a, &b, &out, &["--dt", "0"]).failed(2, &["--dt"]);
}

#[test]
fn uninformative_clouds() {
    let t = Temp::new();
    let good = t.write("good.bin", bin(&positions(&sweeps().0[0])));
    let out = t.path().join("flow.bin");
    let refused = |a: &PathBuf, b: &PathBuf, words: &[&str]| {
        flow(a, b, &out, &[]).failed(3, words);
        assert!(!out.exists());
    };
    let empty = t.write("empty.bin", []);
    refused(&empty, &good, &["empty.bin: none of its 0 points"]);
    refused(&good, &empty, &["empty.bin: none of its 0 points"]);
    let nan = t.write("nan.ply", ply(&[[f32::NAN; 3]; 5]));
    refused(&good, &nan, &["nan.ply: none of its 5 points has finite coordinates"]);
    refused(&nan, &good, &["nan.ply"]);
    let one = t.write("one.ply", ply(&[[5.0, 1.0, -1.7]]));
    refused(&one, &good, &["one.ply", "no ground", "--ground"]);
    refused(&good, &one, &["one.ply", "too few planar patches", "--pose"]);
    flow(&one, &one, &out, &["--ground", "-1.7"]).failed(3, &["too few planar patches"]);
    // Another place.
    let other = Drive::new(78, Options { sweeps: 1, ..Options::default() }).sweep(0);
    let other = t.write("other.bin", bin(&positions(&other)));
    refused(&good, &other, &["other.bin", "cannot be registered", "overlap"]);
    // A bare floor.
    let floor: Vec<[f32; 3]> = (0..40_000)
        .map(|n| [(n % 200) as f32 * 0.2 - 20.0, (n / 200) as f32 * 0.2 - 20.0, -1.7])
        .collect();
    let floor = t.write("floor.bin", bin(&floor));
    refused(&floor, &floor, &["floor.bin", "leaves 3 of the 3 degrees of freedom on the ground"]);
}

fn ply(cloud: &[[f32; 3]]) -> Vec<u8> {
    let head = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n",
        cloud.len()
    );
    head.into_bytes()
        .into_iter()
        .chain(cloud.iter().flatten().flat_map(|v| v.to_le_bytes()))
        .collect()
}

#[test]
fn invalid_files() {
    let t = Temp::new();
    let cloud = bin(&positions(&sweeps().0[0]));
    let good = t.write("good.bin", &cloud);
    let out = t.path().join("flow.bin");
    flow(&good, &t.path().join("absent.bin"), &out, &[]).failed(3, &["absent.bin"]);
    flow(t.path(), &good, &out, &[]).failed(3, &["unknown extension"]);
    let las = t.write("cloud.las", &cloud);
    flow(&las, &good, &out, &[]).failed(3, &["cloud.las", ".feather"]);
    let cut = t.write("cut.bin", &cloud[..1001]);
    flow(&good, &cut, &out, &[]).failed(3, &["cut.bin", "truncated"]);
    flow(&good, &good, &t.path().join("flow.csv"), &[]).failed(2, &["flow.csv", ".feather"]);
    flow(&good, &good, &good.join("flow.bin"), &[]).failed(4, &["flow.bin"]);
    raywake(&["flow", "a.bin"]).failed(2, &["<B>", "--out"]);
    let help = raywake(&["flow", "--help"]);
    help.succeeded();
    assert!(help.stdout.contains("a_from_b") && help.stdout.contains("130  interrupted"));
}

#[cfg(feature = "arrow")]
#[test]
fn tables_in_and_out() {
    use raywake_io::sink::table::TableWriter as Sink;
    use raywake_io::source::feather::FeatherTable;
    let t = Temp::new();
    let cloud = first_cloud();
    let a = t.path().join("a.feather");
    let mut table = Sink::default();
    table.array(["x", "y", "z"], &cloud, |p| *p);
    table.write(&a, &[]).unwrap();
    let b = t.write("b.ply", ply(&positions(&sweeps().0[1])));
    let [plain, out] = ["f.bin", "f.feather"].map(|name| t.path().join(name));
    flow(&a, &b, &plain, &[]).succeeded();
    let mcap = t.path().join("f.mcap");
    let more: &[&str] =
        if cfg!(feature = "mcap") { &["--mcap", mcap.to_str().unwrap()] } else { &[] };
    flow(&a, &b, &out, more).succeeded();
    if !more.is_empty() {
        assert!(std::fs::read(&mcap).unwrap().starts_with(b"\x89MCAP0\r\n"));
    }
    let names = [
        "x_m",
        "y_m",
        "z_m",
        "flow_x_m",
        "flow_y_m",
        "flow_z_m",
        "motion_x_m",
        "motion_y_m",
        "motion_z_m",
        "cov_dx_dx",
        "cov_dx_dy",
        "cov_dy_dy",
    ];
    let table = FeatherTable::read(&out, &[&names[..], &["foreground", "valid"]].concat()).unwrap();
    let columns = names.map(|name| table.floats(name).unwrap());
    let [foreground, valid] = ["foreground", "valid"].map(|name| table.booleans(name).unwrap());
    assert_eq!(table.rows(), cloud.len());
    let same = |a: f64, b: f64| a == b || a.is_nan() && b.is_nan();
    for (row, pair) in rows(&plain).iter().enumerate() {
        for axis in 0..3 {
            assert!(same(columns[axis][row], f64::from(cloud[row][axis])), "row {row}");
            assert!(same(columns[3 + axis][row], pair[0][axis]), "row {row}");
            assert!(same(columns[6 + axis][row], pair[1][axis]), "row {row}");
        }
        assert!(valid[row] || columns[9][row] == 0.0, "row {row}");
        assert!(foreground[row] || pair[1] == DVec3::ZERO || pair[1].is_nan(), "row {row}");
    }
    assert!(valid.iter().filter(|v| **v).count() > 1000);
}
