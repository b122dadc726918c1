//! PCD and PLY files, and folders of them.

use raywake_core::sweep::{Point, Timing};

use super::super::clouds::read_cloud;
use super::*;

const HEAD: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _ intensity time ring\n\
    SIZE 4 4 4 1 4 4 2\nTYPE F F F U F F U\nCOUNT 1 1 1 3 1 1 1\nWIDTH 2\nHEIGHT 1\n\
    VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";

/// The bytes of each field of the two points of [`HEAD`].
fn fields() -> [Vec<Vec<u8>>; 2] {
    [[1.0f32, 2.0, 3.0, 0.5, -0.05], [-4.0, 5.5, -6.0, 0.25, 0.04]].map(|[x, y, z, i, t]| {
        let float = |v: f32| v.to_le_bytes().to_vec();
        vec![float(x), float(y), float(z), vec![9; 3], float(i), float(t), vec![7, 0]]
    })
}

pub(super) fn binary() -> Vec<u8> {
    [HEAD.as_bytes(), b"DATA binary\n", &fields().concat().concat()].concat()
}

/// A compressed file.
pub(super) fn compressed_file() -> Vec<u8> {
    let [a, b] = fields();
    let by_field = a.into_iter().zip(b).map(|(a, b)| [a, b].concat()).collect::<Vec<_>>();
    compressed(&by_field.concat())
}

/// Stored as it is, without any repetition.
fn compressed(body: &[u8]) -> Vec<u8> {
    let packed: Vec<u8> =
        body.chunks(32).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect();
    let lengths = [packed.len(), body.len()].map(|n| (n as u32).to_le_bytes()).concat();
    [HEAD.as_bytes(), b"DATA binary_compressed\n", &lengths, &packed].concat()
}

const TEXT: &str = "1 2 3 9 9 9 0.5 -0.05 7\n\n-4 5.5 -6.0e0 9 9 9 0.25 0.04 7\n";

fn text() -> String {
    format!("{HEAD}DATA ascii\n{TEXT}")
}

fn cloud(t: &Temp, name: &str, content: impl AsRef<[u8]>) -> Result<(Vec<Point>, bool), String> {
    let mut points = vec![Point::default(); 7];
    match read_cloud(&t.write(name, content), None, &mut points) {
        Ok(timed) => Ok((points, timed)),
        Err(e) => {
            assert!(points.is_empty() && e.exit_code() == 3);
            Err(e.to_string())
        }
    }
}

fn expected(timed: bool) -> (Vec<Point>, bool) {
    let point = |position, intensity, offset_s| {
        let offset_s = if timed { offset_s } else { 0.0 };
        Point { position, intensity, offset_s, sensor: 0 }
    };
    (vec![point([1.0, 2.0, 3.0], 0.5, -0.05), point([-4.0, 5.5, -6.0], 0.25, 0.04)], timed)
}

#[test]
fn pcd_of_every_kind() {
    let t = Temp::new();
    assert_eq!(cloud(&t, "a.pcd", text()).unwrap(), expected(true));
    assert_eq!(cloud(&t, "a.pcd", text().replace('\n', "\r\n")).unwrap(), expected(true));
    assert_eq!(cloud(&t, "a.pcd", binary()).unwrap(), expected(true));
    assert_eq!(cloud(&t, "a.pcd", compressed_file()).unwrap(), expected(true));
    // Without COUNT, POINTS and time; NaN stays.
    let old = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\nnan 2 3\n";
    let (points, timed) = cloud(&t, "a.pcd", old).unwrap();
    assert!(points.len() == 1 && points[0].position[0].is_nan() && !timed);
    assert!(cloud(&t, "a.pcd", old.replace("WIDTH 1", "WIDTH 0")).unwrap().0.is_empty());
}

#[test]
fn pcd_headers_that_do_not_fit_together() {
    let t = Temp::new();
    let refused = |part: &str, instead: &str| {
        let whole = text();
        assert!(whole.contains(part), "{part}");
        cloud(&t, "a.pcd", whole.replace(part, instead)).unwrap_err()
    };
    assert!(refused("FIELDS x y z", "FIELDS x y w").ends_with("a.pcd: has no field `z`"));
    assert!(refused("SIZE 4 ", "SIZE ").contains("line 11: FIELDS, SIZE, TYPE and COUNT"));
    assert!(refused("TYPE F", "TYPE G").contains("field `x`: TYPE G of SIZE 4"));
    assert!(refused("SIZE 4", "SIZE 3").contains("field `x`: TYPE F of SIZE 3"));
    assert!(refused("COUNT 1 1 1 3", "COUNT 1 1 1 0").contains("field `_`: COUNT 0"));
    assert!(refused("1 1 1 3", "1 1 1 18446744073709551615").contains("field `_`: COUNT 184"));
    assert!(refused("POINTS 2", "POINTS 3").contains("3 POINTS are not WIDTH times HEIGHT"));
    assert!(refused("POINTS 2", "POINTS -2").contains("line 10: `-2` is not a count"));
    assert!(refused("POINTS 2", "POINTS").contains("line 10: one number expected"));
    assert!(refused("VERSION", "VERSIEN").contains("line 2: `VERSIEN` is not an entry"));
    assert!(refused("ascii", "base64").contains("line 11: unknown DATA base64"));
    assert!(cloud(&t, "a.pcd", "").unwrap_err().contains("line 1: truncated: the header"));
    assert!(cloud(&t, "a.pcd", "DATA ascii\n").unwrap_err().contains("no POINTS before"));
    assert!(
        cloud(&t, "a.pcd", [0xff, b'\n'])
            .unwrap_err()
            .contains("line 1: the header is not UTF-8 text")
    );
    assert!(cloud(&t, "a.pcd", HEAD).unwrap_err().contains("line 11: truncated: the header"));
}

#[test]
fn pcd_bodies_that_end_early() {
    let t = Temp::new();
    let whole = binary();
    let cut = cloud(&t, "a.pcd", &whole[..whole.len() - 1]).unwrap_err();
    assert!(cut.contains("a.pcd, byte ") && cut.contains("truncated: 2 points of 25 bytes, 49"));
    let many = String::from_utf8_lossy(&whole)
        .replace("POINTS 2", "POINTS 9000000000000000000")
        .replace("WIDTH 2", "WIDTH 9000000000000000000");
    assert!(cloud(&t, "a.pcd", many).unwrap_err().contains("truncated: 90000"));
    let last = text().replace("0.04 7\n", "0.04\n");
    assert!(cloud(&t, "a.pcd", last).unwrap_err().contains("line 14: 9 numbers expected, 8 found"));
    let line = text().lines().take(12).map(|l| l.to_owned() + "\n").collect::<String>();
    assert!(cloud(&t, "a.pcd", line).unwrap_err().contains("truncated: 2 points expected, 1"));
    assert!(cloud(&t, "a.pcd", text().replace("5.5", "5,5")).unwrap_err().contains("`5,5`"));
    let mut odd = text().into_bytes();
    let n = odd.len();
    odd[n - 3] = 0xff;
    assert!(cloud(&t, "a.pcd", odd).unwrap_err().contains("is not UTF-8 text"));
    let packed = compressed(&[1; 50]);
    assert!(cloud(&t, "a.pcd", &packed[..packed.len() - 1]).unwrap_err().contains("packed bytes"));
    assert!(cloud(&t, "a.pcd", &packed[..packed.len() - 53]).unwrap_err().contains("two lengths"));
    let short = cloud(&t, "a.pcd", compressed(&[1; 49])).unwrap_err();
    assert!(short.contains("unpacks to 49 bytes, the header expects 50"), "{short}");
    let bomb = String::from_utf8_lossy(&packed)
        .replace("POINTS 2", "POINTS 2000000")
        .replace("WIDTH 2", "WIDTH 2000000");
    let bomb = cloud(&t, "a.pcd", bomb).unwrap_err();
    assert!(bomb.contains("unpacks to 50000000 bytes, at most 167"), "{bomb}");
    let body = packed.len() - 52;
    let mut damaged = packed;
    damaged[body] = 0xff;
    assert!(cloud(&t, "a.pcd", damaged).unwrap_err().contains("a back reference before the start"));
}

const PLY: &str = "ply\nformat FORMAT 1.0\ncomment made by hand\nelement vertex 2\n\
    property double x\nproperty float y\nproperty float z\nproperty uchar intensity\n\
    property int t\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

pub(super) fn ply(format: &str, body: &[u8]) -> Vec<u8> {
    [PLY.replace("FORMAT", format).as_bytes(), body].concat()
}

/// The vertices in a byte order, with the faces cut off.
pub(super) fn vertices(big: bool) -> Vec<u8> {
    let order = |mut bytes: Vec<u8>| {
        if big {
            bytes.reverse();
        }
        bytes
    };
    let vertex = |x: f64, y: f32, z: f32, i: u8, t: i32| {
        let parts = [x.to_le_bytes().to_vec(), y.to_le_bytes().to_vec(), z.to_le_bytes().to_vec()];
        let parts = parts.into_iter().chain([vec![i], t.to_le_bytes().to_vec()]);
        parts.flat_map(order).collect::<Vec<u8>>()
    };
    [vertex(1.0, 2.0, 3.0, 51, -50_000_000), vertex(-4.0, 5.5, -6.0, 255, 40_000_000)].concat()
}

#[test]
fn ply_of_every_kind() {
    let t = Temp::new();
    let text = b"1 2 3 51 -50000000\n-4 5.5 -6 255 40000000\n3 0 1 1\n";
    for (format, body) in [
        ("ascii", text.to_vec()),
        ("binary_little_endian", vertices(false)),
        ("binary_big_endian", vertices(true)),
    ] {
        let (points, timed) = cloud(&t, "a.ply", ply(format, &body)).unwrap();
        let mut wanted = expected(true).0;
        (wanted[0].intensity, wanted[1].intensity) = (0.2, 1.0);
        assert_eq!((points, timed), (wanted, true), "{format}");
        let cut = cloud(&t, "a.ply", ply(format, &body[..19])).unwrap_err();
        assert!(cut.contains("a.ply") && cut.contains("truncated: 2 points"), "{cut}");
    }
}

#[test]
fn ply_headers_that_do_not_fit_together() {
    let t = Temp::new();
    let refused = |part: &str, instead: &str| {
        let whole = String::from_utf8(ply("ascii", b"1 2 3 4 5\n6 7 8 9 10\n")).unwrap();
        assert!(whole.contains(part), "{part}");
        cloud(&t, "a.ply", whole.replace(part, instead)).unwrap_err()
    };
    assert!(refused("ply", "plx").contains("line 1: is not a PLY file"));
    assert!(refused("ascii", "ebcdic").contains("line 2: `format ebcdic 1.0` makes no sense"));
    assert!(refused("format ascii 1.0\n", "").contains("no format before"));
    assert!(refused("vertex 2", "vertex -2").contains("line 4: `-2` is not a count"));
    assert!(refused("element vertex", "element camera").contains("comes before the vertices"));
    assert!(refused("float y", "quad y").contains("line 6: unknown type `quad`"));
    assert!(refused("float z", "float w").ends_with("a.ply: has no field `z`"));
    assert!(
        refused("uchar intensity", "list uchar int i").contains("line 8: a vertex with a list")
    );
    assert!(refused("element vertex 2\n", "").contains("line 4: `property double x` makes no"));
    assert!(refused("end_header\n", "").contains("makes no sense"));
    assert!(cloud(&t, "a.ply", "ply\n").unwrap_err().contains("line 2: truncated: the header"));
}

#[test]
fn folders_of_clouds() {
    let t = Temp::new();
    t.write("0.pcd", text());
    t.write("1.pcd", binary());
    let poses = t.write("elsewhere/p.txt", row(0.0, 0.0, 0.0) + &row(0.5, 0.0, 0.0));
    let options = OpenOptions { poses: Some(poses), ..OpenOptions::default() };
    let mut source = open(t.path(), &options).unwrap();
    let Timing::Offset { from_s, span_s } = source.rig().timing else { panic!() };
    assert!((from_s + 0.05).abs() < 1e-6 && (span_s - 0.09).abs() < 1e-6, "{from_s} {span_s}");
    assert_eq!(read(source.as_mut(), 1).unwrap().points, expected(true).0);
    // All at one time: the same as none.
    t.write("0.pcd", text().replace("-0.05", "0.04"));
    assert!(matches!(open(t.path(), &options).unwrap().rig().timing, Timing::Azimuth { .. }));
    t.write("0.pcd", text().replace("-0.05", "-5"));
    let long = refused_with(t.path(), &options);
    assert!(
        long.contains("0.pcd: returns from 0.000 to 5.040 s around the stamp of a sweep; 1 s"),
        "{long}"
    );
    t.write("0.ply", "");
    assert!(refused_with(t.path(), &options).contains("contains both `.pcd` and `.ply` files"));
    t.remove("0.pcd");
    t.remove("1.pcd");
    assert!(refused(t.path()).contains("point clouds only: poses are needed"));
}
