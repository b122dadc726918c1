//! Labels in feather files: Argoverse 2's `annotations.feather`, and `truth/objects.feather` of
//! simulated drives.

use super::gather::{Gather, Row};
use super::{Error, Labels, View};
use glam::DQuat;
use raywake::source::feather::Table;
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

/// Both have it.
const ROTATION: [&str; 4] = ["qx", "qy", "qz", "qw"];

/// Annotations of an Argoverse 2 log: frames are timestamps, ns; labelled all around, on what no
/// return comes from too.
pub(super) fn annotations(path: &Path) -> Result<Labels, Error> {
    read(path, &ANNOTATIONS, |table| table.strings(ANNOTATIONS.id))
}

/// Objects of a simulated drive, exact.
pub(super) fn objects(path: &Path) -> Result<Labels, Error> {
    let ids = |table: &Table| {
        Ok(table.integers(OBJECTS.id)?.iter().map(i64::to_string).collect::<Vec<_>>())
    };
    Ok(Labels { exact: true, ..read(path, &OBJECTS, ids)? })
}

fn read(
    path: &Path,
    names: &Names,
    ids: impl Fn(&Table) -> Result<Vec<String>, Error>,
) -> Result<Labels, Error> {
    let keys = [names.frame, names.id, names.class];
    let table = Table::read(path, &[&keys[..], &names.centre, &names.size, &ROTATION].concat())?;
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
        gather.add(&Row {
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
