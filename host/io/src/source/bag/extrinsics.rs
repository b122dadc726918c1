//! Mounting poses of lidars given by the user: links between frames that replace those of
//! `/tf_static`.

use std::path::Path;

use super::contents::{CloudTopic, Contents};
use super::messages::Transform;
use crate::Error;
use crate::source::poses::rigid;
use crate::source::{text, whole};

/// Adds the links of a file to those of the recording, over which they take precedence. One per
/// line: the parent frame, the child frame, and the child's position (x y z, m) and quaternion (x y
/// z w) in the parent. The child may be a topic, whose clouds then are in a frame of that name.
/// Text after `#` is ignored.
///
/// # Errors
/// With the line if it is not such a link, or if nothing is in the child frame.
pub(super) fn add(path: &Path, contents: &mut Contents) -> Result<(), Error> {
    let content = whole::read_settings(path)?;
    for (number, line) in text::lines(&content) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let wrong = |what: &str| Error::input(path, format!("line {number}"), what);
        let named = line.split_once(char::is_whitespace).and_then(|(parent, rest)| {
            let (child, numbers) = rest.trim_start().split_once(char::is_whitespace)?;
            Some((parent, child, numbers))
        });
        let (parent, child, numbers) =
            named.ok_or_else(|| wrong("expected PARENT CHILD x y z qx qy qz qw"))?;
        let [x, y, z, a, b, c, d] = text::exactly(path, number, numbers)?;
        let parent_from_child = rigid([x, y, z], [a, b, c, d]).map_err(wrong)?;
        let (parent, mut child) = (parent.trim_start_matches('/').to_owned(), child.to_owned());
        match contents.topics.get_mut(&child) {
            Some(topic) => topic.frame.clone_from(&child),
            None => child = child.trim_start_matches('/').to_owned(),
        }
        let is_known = contents.topics.values().any(|topic| topic.frame == child)
            || contents.poses.keys().any(|source| source.child == child);
        if !is_known && !contents.fixed.has(&child) {
            let frame =
                |(name, topic): (&String, &CloudTopic)| format!("`{}` of {name}", topic.frame);
            let frames: Vec<String> = contents.topics.iter().map(frame).collect();
            let there = frames.join(", ");
            return Err(wrong(&format!(
                "no clouds or poses in frame `{child}`; clouds are in {there}"
            )));
        }
        contents.fixed.add(Transform { stamp_ns: 0, parent, child, parent_from_child });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::tests::{accept, file, options, rig};
    use crate::source::tests::Temp;
    use crate::source::{OpenOptions, Source, SweepData, open};

    const BY_FRAME: &str = "# mounted in May\n\nbase_link lidar 1 0 1.8 0 0 0 1\n\
                            base_link rear -2 0 0.9 0 0 0 1 # at the rear\n";

    /// A recording without `/tf_static`, and options with a file of links.
    fn with_links(temp: &Temp, links: &str) -> (PathBuf, OpenOptions) {
        let all: Vec<_> = rig(3).into_iter().filter(|message| message.0 != "/tf_static").collect();
        let extrinsics = Some(temp.write("links.txt", links));
        (temp.write("bare.mcap", file(&all, options())), OpenOptions { extrinsics, ..accept() })
    }

    fn points(source: &mut dyn Source) -> Vec<[f32; 3]> {
        let mut sweep = SweepData::default();
        source.read(1, &mut sweep).unwrap();
        sweep.points.iter().map(|point| point.position).collect()
    }

    #[test]
    fn given_links_replace_those_of_the_recording() {
        let temp = Temp::new();
        let whole = temp.write("whole.mcap", file(&rig(3), options()));
        let mut whole = open(&whole, &accept()).unwrap();
        let (path, by_frame) = with_links(&temp, BY_FRAME);
        let e = open(&path, &accept()).err().unwrap().to_string();
        assert!(e.contains("several topics have clouds"), "{e}");
        let mut source = open(&path, &by_frame).unwrap();
        assert_eq!(points(source.as_mut()), points(whole.as_mut()));
        assert!(source.is_located() && source.rig().sensors == whole.rig().sensors);
        // Topics may be named if drivers use the same frame for all lidars.
        let by_topic = BY_FRAME.replace(" lidar ", " /points ").replace(" rear ", " /rear ");
        let (path, by_topic) = with_links(&temp, &by_topic);
        assert_eq!(points(open(&path, &by_topic).unwrap().as_mut()), points(whole.as_mut()));
    }

    #[test]
    fn invalid_links_are_named() {
        let temp = Temp::new();
        for (links, says) in [
            ("base_link lidar", "line 1: expected PARENT CHILD x y z"),
            ("\nbase_link lidar 1 2 3 0 0 0", "line 2: 7 numbers expected, 6 found"),
            ("base_link lidar 1 2 x 0 0 0 1", "line 1: `x` is not a number"),
            ("base_link lidar 1 2 3 0 0 0 2", "line 1: the quaternion of the pose"),
            (
                "base_link mast 1 2 3 0 0 0 1",
                "no clouds or poses in frame `mast`; clouds are in `lidar` of /points",
            ),
        ] {
            let (path, options) = with_links(&temp, links);
            let e = open(&path, &options).err().unwrap().to_string();
            assert!(e.contains("links.txt") && e.contains(says), "{says} in {e}");
        }
        let drive = OpenOptions { extrinsics: Some("x".into()), ..OpenOptions::default() };
        temp.write("d/velodyne_points/data/0.bin", []);
        let e = open(&temp.path().join("d"), &drive).err().unwrap().to_string();
        assert!(e.contains("--extrinsics applies only to MCAP recordings"), "{e}");
    }
}
