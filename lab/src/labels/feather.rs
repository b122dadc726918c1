//! Labels in feather files: Argoverse 2's `annotations.feather`, and `truth/objects.feather` of
//! simulated drives.

use super::gather::{Gather, LabelRow};
use super::{Error, Labels, View};
use glam::DQuat;
use raywake_io::source::feather::FeatherTable;
use std::path::Path;

/// Names of the columns of such a file.
struct Names {
    frame: &'static str,
    id: &'static str,
    class: &'static str,
    centre: [&'static str; 3],
    size: [&'static str; 3],
}

const ANNOTATIONS: Names = Names {
    frame: "timestamp_ns",
    id: "track_uuid",
    class: "category",
    centre: ["tx_m", "ty_m", "tz_m"],
    size: ["length_m", "width_m", "height_m"],
};

const OBJECTS: Names = Names {
    frame: "frame",
    id: "id",
    class: "class",
    centre: ["x", "y", "z"],
    size: ["length", "width", "height"],
};

/// Shared by both.
const ROTATION: [&str; 4] = ["qx", "qy", "qz", "qw"];

/// Annotations of an Argoverse 2 log: frames are timestamps, ns; labelled all round, including
/// objects without returns.
pub(super) fn annotations(path: &Path) -> Result<Labels, Error> {
    read(path, &ANNOTATIONS, |table| table.strings(ANNOTATIONS.id))
}

/// Objects of a simulated drive, exact.
pub(super) fn objects(path: &Path) -> Result<Labels, Error> {
    let ids = |table: &FeatherTable| {
        Ok(table.integers(OBJECTS.id)?.iter().map(i64::to_string).collect::<Vec<_>>())
    };
    Ok(Labels { exact: true, ..read(path, &OBJECTS, ids)? })
}

fn read(
    path: &Path,
    names: &Names,
    ids: impl Fn(&FeatherTable) -> Result<Vec<String>, Error>,
) -> Result<Labels, Error> {
    let keys = [names.frame, names.id, names.class];
    let table =
        FeatherTable::read(path, &[&keys[..], &names.centre, &names.size, &ROTATION].concat())?;
    let floats = |names: &[&str]| {
        names.iter().map(|name| table.floats(name)).collect::<Result<Vec<_>, Error>>()
    };
    let frames = table.integers(names.frame)?;
    let (ids, classes) = (ids(&table)?, table.strings(names.class)?);
    let (centre, size) = (floats(&names.centre)?, floats(&names.size)?);
    let rotation = floats(&ROTATION)?;
    let mut gather = Gather::default();
    for row in 0..table.rows() {
        let Ok(frame) = u64::try_from(frames[row]) else {
            gather.leave_out("boxes left out: a negative frame");
            continue;
        };
        let three = |columns: &[Vec<f64>]| [0, 1, 2].map(|i| columns[i][row]);
        gather.add(&LabelRow {
            id: &ids[row],
            class: &classes[row],
            frame,
            size: three(&size),
            centre: three(&centre),
            rotation: DQuat::from_array([0, 1, 2, 3].map(|i| rotation[i][row])),
        });
    }
    Ok(gather.finish(View::All))
}

#[cfg(test)]
mod tests {
    use super::super::Kind;
    use super::*;
    use crate::scratch::Scratch;
    use arrow_array::{
        ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray, UInt32Array, UInt64Array,
    };
    use arrow_ipc::writer::FileWriter;
    use glam::DVec3;
    use std::fs;
    use std::path::PathBuf;
    use std::sync::Arc;

    fn write(t: &Scratch, name: &str, columns: Vec<(&str, ArrayRef)>) -> PathBuf {
        let batch = RecordBatch::try_from_iter(columns).unwrap();
        let mut writer = FileWriter::try_new(Vec::new(), &batch.schema()).unwrap();
        writer.write(&batch).unwrap();
        t.write(name, writer.into_inner().unwrap())
    }

    fn floats(values: [f64; 2]) -> ArrayRef {
        Arc::new(Float64Array::from(values.to_vec()))
    }

    /// Columns of boxes except their keys; the second box is 1.5 m further on.
    fn columns<'a>(centre: [&'a str; 3], size: [&'a str; 3], x: f64) -> Vec<(&'a str, ArrayRef)> {
        let [qw, q] = [[1.0; 2], [0.0; 2]].map(floats);
        let mut columns = vec![("qw", qw), ("qx", q.clone()), ("qy", q.clone()), ("qz", q)];
        columns.extend(centre.into_iter().zip([[x, x + 1.5], [2.0; 2], [0.5; 2]].map(floats)));
        columns.extend(size.into_iter().zip([[4.0; 2], [1.8; 2], [1.5; 2]].map(floats)));
        columns
    }

    fn logged(t: &Scratch, x: f64, stamps: [i64; 2]) -> PathBuf {
        let text = |value: &str| Arc::new(StringArray::from(vec![value; 2]));
        let mut all = columns(["tx_m", "ty_m", "tz_m"], ["length_m", "width_m", "height_m"], x);
        all.push(("timestamp_ns", Arc::new(Int64Array::from(stamps.to_vec()))));
        all.push(("track_uuid", text("ab-c")));
        all.push(("category", text("REGULAR_VEHICLE")));
        write(t, "annotations.feather", all)
    }

    #[test]
    fn annotations_of_a_log() {
        let t = Scratch::new();
        let labels = annotations(&logged(&t, 7.0, [100, 200])).unwrap();
        assert_eq!((labels.view, labels.exact, labels.notes.len()), (View::All, false, 0));
        let [track] = &labels.tracks[..] else { panic!("{labels:?}") };
        assert_eq!(
            (track.id.as_str(), track.kind, track.size),
            ("ab-c", Kind::Car, [4.0, 1.8, 1.5])
        );
        assert_eq!(track.boxes[&200].translation, DVec3::new(8.5, 2.0, 0.5));
        let odd = annotations(&logged(&t, f64::NAN, [100, 200])).unwrap();
        assert_eq!(odd.notes, ["2 boxes left out: a NaN or infinite number"]);
        let negative = annotations(&logged(&t, 7.0, [-1, 200])).unwrap();
        assert_eq!(negative.notes, ["1 boxes left out: a negative frame"]);
        let twice = annotations(&logged(&t, 7.0, [200, 200])).unwrap();
        assert_eq!(twice.notes, ["1 boxes left out: the track already has one in that frame"]);
    }

    #[test]
    fn damaged_feather_files() {
        let t = Scratch::new();
        let whole = fs::read(logged(&t, 7.0, [100, 200])).unwrap();
        let refused = |bytes: &[u8]| {
            let path = t.write("annotations.feather", bytes);
            annotations(&path).unwrap_err().to_string()
        };
        assert!(refused(&whole[..whole.len() / 2]).contains("annotations.feather: truncated"));
        assert!(refused(&[]).contains("annotations.feather: is not a feather file"));
        let path = write(&t, "annotations.feather", vec![("qw", floats([1.0; 2]))]);
        let e = annotations(&path).unwrap_err().to_string();
        assert!(e.ends_with("annotations.feather: has no column `timestamp_ns`"), "{e}");
    }

    #[test]
    fn objects_of_a_simulated_drive() {
        let t = Scratch::new();
        let mut all = columns(["x", "y", "z"], ["length", "width", "height"], 7.0);
        all.push(("frame", Arc::new(UInt64Array::from(vec![3, 4]))));
        all.push(("id", Arc::new(UInt32Array::from(vec![9, 9]))));
        all.push(("class", Arc::new(StringArray::from(vec!["Pedestrian"; 2]))));
        let labels = objects(&write(&t, "truth/objects.feather", all)).unwrap();
        assert_eq!((labels.view, labels.exact, labels.notes.len()), (View::All, true, 0));
        let track = &labels.tracks[0];
        assert_eq!((track.id.as_str(), track.kind, track.boxes.len()), ("9", Kind::Pedestrian, 2));
    }
}
