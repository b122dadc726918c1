//! `tracklet_labels.xml` of a KITTI raw drive, as serialised by Boost.
//!
//! An item of `tracklets` is a track: `objectType`, `h`, `w`, `l`, `first_frame`, and in `poses` an
//! item for every frame from that one on. A pose is that of the centre of the box's bottom in the
//! Velodyne's frame (Geiger et al. 2013).

use super::gather::{Gather, LabelRow};
use super::{Error, Labels, View};
use glam::{DQuat, DVec3};
use raywake_io::source::boost;
use roxmltree::{Document, Node};
use std::path::Path;

/// Value of `state` for a pose that was never set.
const UNSET: u64 = 0;

/// Reads a file. Poses that were never set are left out.
///
/// Fails if the file cannot be read, is not well-formed XML, lacks an element, or has a different
/// number of items than it states.
pub(super) fn read(path: &Path) -> Result<Labels, Error> {
    boost::read(path, |document| labels(path, document))
}

fn labels(path: &Path, document: &Document) -> Result<Labels, Error> {
    let file = File { path, document };
    let mut gather = Gather::default();
    let tracklets = file.child(document.root_element(), "tracklets")?;
    for (index, item) in file.items(tracklets)?.into_iter().enumerate() {
        file.track(item, &index.to_string(), &mut gather)?;
    }
    Ok(gather.finish(View::Camera))
}

/// A parsed file with its name.
struct File<'a> {
    path: &'a Path,
    document: &'a Document<'a>,
}

impl<'a> File<'a> {
    fn track(&self, item: Node<'a, 'a>, id: &str, gather: &mut Gather) -> Result<(), Error> {
        let class = self.text(item, "objectType")?;
        let size = [self.number(item, "l")?, self.number(item, "w")?, self.number(item, "h")?];
        let first: u32 = self.number(item, "first_frame")?;
        let poses = self.child(item, "poses")?;
        for (n, pose) in self.items(poses)?.into_iter().enumerate() {
            if self.number::<u64>(pose, "state")? == UNSET {
                gather.leave_out("boxes left out: their pose was never set");
                continue;
            }
            let number = |name: &str| self.number::<f64>(pose, name);
            let rotation = DQuat::from_rotation_z(number("rz")?)
                * DQuat::from_rotation_y(number("ry")?)
                * DQuat::from_rotation_x(number("rx")?);
            let bottom = DVec3::new(number("tx")?, number("ty")?, number("tz")?);
            let centre = (bottom + rotation * DVec3::new(0.0, 0.0, 0.5 * size[2])).to_array();
            let frame = u64::from(first) + n as u64;
            gather.add(&LabelRow { id, class, frame, size, centre, rotation });
        }
        Ok(())
    }

    fn error(&self, node: Node, what: String) -> Error {
        let line = self.document.text_pos_at(node.range().start).row;
        Error::input(self.path, format!("line {line}"), what)
    }

    fn child(&self, node: Node<'a, 'a>, name: &str) -> Result<Node<'a, 'a>, Error> {
        let lacks = || self.error(node, format!("<{}> has no <{name}>", node.tag_name().name()));
        node.children().find(|c| c.has_tag_name(name)).ok_or_else(lacks)
    }

    fn text(&self, node: Node<'a, 'a>, name: &str) -> Result<&'a str, Error> {
        Ok(self.child(node, name)?.text().unwrap_or("").trim())
    }

    fn number<T: std::str::FromStr>(&self, node: Node<'a, 'a>, name: &str) -> Result<T, Error> {
        let text = self.text(node, name)?;
        text.parse().map_err(|_| self.error(node, format!("<{name}>: `{text}` is not a number")))
    }

    /// The items of a list, checked against its `count`.
    fn items(&self, list: Node<'a, 'a>) -> Result<Vec<Node<'a, 'a>>, Error> {
        let items: Vec<_> = list.children().filter(|c| c.has_tag_name("item")).collect();
        let count: usize = self.number(list, "count")?;
        if count == items.len() {
            return Ok(items);
        }
        let name = list.tag_name().name();
        Err(self.error(list, format!("<{name}> states {count} items but has {}", items.len())))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Kind;
    use super::*;
    use crate::scratch::Scratch;

    fn pose(x: f64, rest: &str) -> String {
        format!(
            "<item><tx>{x}</tx><ty>2</ty><tz>-1.7</tz><rx>0</rx><ry>0</ry><rz>1.5</rz>{rest}\
             <occlusion>0</occlusion><truncation>0</truncation></item>\n"
        )
    }

    fn file() -> String {
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\" ?>\n\
             <!DOCTYPE boost_serialization>\n\
             <boost_serialization signature=\"serialization::archive\" version=\"9\">\n\
             <tracklets class_id=\"0\" tracking_level=\"0\" version=\"0\">\n\
             <count>1</count><item_version>1</item_version>\n\
             <item class_id=\"1\" tracking_level=\"0\" version=\"1\">\n\
             <objectType>Van</objectType><h>2</h><w>1.8</w><l>4.4</l><first_frame>5</first_frame>\n\
             <poses class_id=\"2\" tracking_level=\"0\" version=\"0\">\n\
             <count>3</count><item_version>2</item_version>\n\
             {}{}{}</poses><finished>1</finished></item></tracklets></boost_serialization>\n",
            pose(10.0, "<state>2</state>"),
            pose(99.0, "<state>0</state>"),
            pose(11.0, "<state>1</state>")
        )
    }

    #[test]
    fn a_track() {
        let t = Scratch::new();
        let labels = read(&t.write("tracklet_labels.xml", file())).unwrap();
        assert_eq!((labels.tracks.len(), labels.view), (1, View::Camera));
        let track = &labels.tracks[0];
        assert_eq!((track.kind, track.size), (Kind::Van, [4.4, 1.8, 2.0]));
        assert_eq!(track.boxes.keys().copied().collect::<Vec<_>>(), [5, 7]);
        let last = track.boxes[&7];
        assert!((last.translation - DVec3::new(11.0, 2.0, -0.7)).length() < 1e-12, "{last:?}");
        assert!((last.yaw_rad() - 1.5).abs() < 1e-12);
        assert_eq!(labels.notes, ["1 boxes left out: their pose was never set"]);
    }

    #[test]
    fn mistakes_are_named() {
        let t = Scratch::new();
        let refused = |text: &str| {
            let path = t.write("tracklet_labels.xml", text);
            read(&path).unwrap_err().to_string()
        };
        let whole = file();
        let cut = refused(&whole[..whole.len() / 2]);
        assert!(
            cut.contains("tracklet_labels.xml, line ") && cut.contains("not valid XML"),
            "{cut}"
        );
        assert!(refused("").contains("not valid XML"));
        let without = |part: &str, instead: &str| refused(&whole.replace(part, instead));
        let entity = "<!DOCTYPE boost_serialization [<!ENTITY a \"b\">]>";
        assert!(
            without("<!DOCTYPE boost_serialization>", entity).ends_with("which boost does not")
        );
        let attributes: String = (0..200).map(|n| format!(" a{n}=\"&gt;\"")).collect();
        let many = without("<finished>", &format!("<finished b=\">\"{attributes}>"));
        assert!(many.ends_with("201 attributes in one element"), "{many}");
        assert!(without("<h>2</h>", "").ends_with("line 6: <item> has no <h>"));
        assert!(without("<h>2</h>", "<h>tall</h>").contains("<h>: `tall` is not a number"));
        assert!(
            without("<count>3</count>", "<count>4</count>")
                .contains("<poses> states 4 items but has 3")
        );
        assert!(
            without("<count>1</count>", "<count>0</count>").contains("<tracklets> states 0 items")
        );
        assert!(without("<first_frame>5", "<first_frame>-5").contains("`-5` is not a number"));
        assert!(without("tracklets", "others").contains("has no <tracklets>"));
        assert!(without("<rz>1.5</rz>", "").contains("<item> has no <rz>"));
    }

    #[test]
    fn invalid_entries_are_counted() {
        let t = Scratch::new();
        let notes = |part: &str, instead: &str| {
            let text = file().replace(part, instead);
            read(&t.write("tracklet_labels.xml", text)).unwrap().notes.join("; ")
        };
        assert!(notes("<tx>10</tx>", "<tx>nan</tx>").contains("1 boxes left out: a NaN"));
        assert!(notes("<w>1.8</w>", "<w>0</w>").contains("2 boxes left out: length, width"));
        assert!(notes("Van", "Zeppelin").contains("unknown class `Zeppelin`: 1 tracks"));
    }
}
