//! `boxes.csv`: `frame,track_id,class,x,y,z,l,w,h,yaw,...`, a header, then one box per line; the
//! centre in the vehicle frame, metres, yaw about +z in radians.

use super::gather::{Gather, LabelRow, heading};
use super::{Error, Labels, View};
use glam::DVec3;
use raywake_io::source::{text, whole};
use std::path::Path;

/// First columns, in this order; others may follow.
const COLUMNS: [&str; 10] = ["frame", "track_id", "class", "x", "y", "z", "l", "w", "h", "yaw"];

/// Reads a file. Its labels are taken to be complete all round if one of its boxes lies wholly
/// behind the vehicle frame's origin, where no forward-looking camera sees; otherwise in the
/// camera's view.
///
/// Fails if it cannot be read or lacks a column, or a line is not a box.
pub(super) fn read(path: &Path) -> Result<Labels, Error> {
    let text = whole::read_text(path)?;
    let mut lines = text::lines(&text);
    let header = lines.next().map_or("", |(_, line)| line);
    if !header.split(',').map(str::trim).zip(COLUMNS).all(|(a, b)| a == b)
        || header.split(',').count() < COLUMNS.len()
    {
        let what = format!("the header does not begin with {}", COLUMNS.join(","));
        return Err(Error::input(path, "line 1", what));
    }
    let mut gather = Gather::default();
    for (line, content) in lines {
        let fields: Vec<&str> = content.split(',').map(str::trim).collect();
        let row = row(&fields).map_err(|what| {
            Error::input(path, format!("line {line}"), format!("not a box: {what}"))
        })?;
        gather.add(&row);
    }
    let mut labels = gather.finish(View::Camera);
    if labels.tracks.iter().any(|t| t.boxes.values().any(|b| behind(b, t.size))) {
        labels.view = View::All;
    }
    Ok(labels)
}

fn row<'a>(fields: &[&'a str]) -> Result<LabelRow<'a>, String> {
    if fields.len() < COLUMNS.len() {
        return Err(format!("{} fields, {} expected", fields.len(), COLUMNS.len()));
    }
    let number = |n: usize| {
        let bad = |_| format!("`{}` is not a valid {}", fields[n], COLUMNS[n]);
        fields[n].parse::<f64>().map_err(bad)
    };
    Ok(LabelRow {
        id: fields[1],
        class: fields[2],
        frame: fields[0].parse().map_err(|_| format!("`{}` is not a frame number", fields[0]))?,
        size: [number(6)?, number(7)?, number(8)?],
        centre: [number(3)?, number(4)?, number(5)?],
        rotation: heading(number(9)?),
    })
}

/// Whether every corner lies behind the origin.
fn behind(vehicle_from_box: &raywake_core::pose::Pose, size: [f64; 3]) -> bool {
    let half = 0.5 * DVec3::from_array(size);
    let reach = (vehicle_from_box.rotation.conjugate() * DVec3::X).abs().dot(half);
    vehicle_from_box.translation.x + reach < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    const HEADER: &str = "frame,track_id,class,x,y,z,l,w,h,yaw,occlusion\n";

    #[test]
    fn boxes_are_read_or_refused() {
        let t = Scratch::new();
        let read_text = |text: &str| read(&t.write("boxes.csv", HEADER.to_owned() + text));
        let labels =
            read_text("7,3,Van,10,2,-0.8,4,2,1.9,1.5707963,0\n8,3,Van,10,3,-0.8,4,2,1.9,1.5,0\n");
        let labels = labels.unwrap();
        assert_eq!((labels.tracks.len(), labels.view), (1, View::Camera));
        let track = &labels.tracks[0];
        assert_eq!((track.id.as_str(), track.size, track.boxes.len()), ("3", [4.0, 2.0, 1.9], 2));
        assert_eq!(track.boxes[&7].translation.to_array(), [10.0, 2.0, -0.8]);
        let refused = |text: &str| read_text(text).unwrap_err().to_string();
        assert!(
            refused("7,3,Van,10,2,-0.8,4,2,1.9")
                .ends_with("line 2: not a box: 9 fields, 10 expected")
        );
        assert!(refused("7,3,Van,x,2,-0.8,4,2,1.9,0").contains("`x` is not a valid x"));
        assert!(refused("-7,3,Van,1,2,-0.8,4,2,1.9,0").contains("`-7` is not a frame number"));
        let odd = read_text("7,3,Van,NaN,2,-0.8,4,2,1.9,0\n7,4,Van,1,2,-0.8,4,0,1.9,0").unwrap();
        assert_eq!((odd.tracks.len(), odd.notes.len()), (0, 2));
        let headless = t.write("boxes.csv", "7,3,Van,10,2,-0.8,4,2,1.9,0\n");
        assert!(read(&headless).unwrap_err().to_string().contains("line 1: the header"));
        assert!(read(&t.write("boxes.csv", "")).is_err());
    }

    #[test]
    fn a_box_behind_shows_that_labels_lie_all_around() {
        let t = Scratch::new();
        let view = |line: &str| {
            let path = t.write("boxes.csv", HEADER.to_owned() + line);
            read(&path).unwrap().view
        };
        assert_eq!(view("0,1,Car,-1.9,2,0,4,2,2,0,0"), View::Camera);
        assert_eq!(view("0,1,Car,-1.9,2,0,4,2,2,1.5707963,0"), View::All);
        assert_eq!(view("0,1,Car,-2.1,2,0,4,2,2,0,0"), View::All);
    }
}
