//! SemanticKITTI: a class and an instance for every return, `labels/NNNNNN.label` beside
//! `velodyne/NNNNNN.bin` (Behley et al. 2019).

use super::{Error, Kind, kind};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Label of one return.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointLabel {
    /// Number of the class, the lower half of the word.
    pub class: u16,
    /// Number of the object within its class, over the sequence; 0 for classes without instances.
    pub instance: u16,
}

/// Numbers and names of the classes.
const CLASSES: [(u16, &str); 34] = [
    (0, "unlabeled"),
    (1, "outlier"),
    (10, "car"),
    (11, "bicycle"),
    (13, "bus"),
    (15, "motorcycle"),
    (16, "on-rails"),
    (18, "truck"),
    (20, "other-vehicle"),
    (30, "person"),
    (31, "bicyclist"),
    (32, "motorcyclist"),
    (40, "road"),
    (44, "parking"),
    (48, "sidewalk"),
    (49, "other-ground"),
    (50, "building"),
    (51, "fence"),
    (52, "other-structure"),
    (60, "lane-marking"),
    (70, "vegetation"),
    (71, "trunk"),
    (72, "terrain"),
    (80, "pole"),
    (81, "traffic-sign"),
    (99, "other-object"),
    (252, "moving-car"),
    (253, "moving-bicyclist"),
    (254, "moving-person"),
    (255, "moving-motorcyclist"),
    (256, "moving-on-rails"),
    (257, "moving-bus"),
    (258, "moving-truck"),
    (259, "moving-other-vehicle"),
];

impl PointLabel {
    /// The label of a class, without an instance.
    pub fn of_class(class: u16) -> PointLabel {
        PointLabel { class, instance: 0 }
    }

    /// Name of the class; `None` if the data set has no such number.
    pub fn name(self) -> Option<&'static str> {
        CLASSES.iter().find(|c| c.0 == self.class).map(|c| c.1)
    }

    /// The same, or the number of a class without a name.
    pub fn describe(self) -> String {
        self.name().map_or(format!("class {}", self.class), String::from)
    }

    /// Whether it has no class or is an outlier (0 and 1).
    pub fn is_unlabelled(self) -> bool {
        self.class <= 1
    }

    /// Whether it belongs to an object that moved at some time in the sequence (252 to 259).
    pub fn moving(self) -> bool {
        (252..=259).contains(&self.class)
    }

    /// Kind of the object; `None` for classes of no object that could move, and for unlabelled
    /// returns.
    pub fn kind(self) -> Option<Kind> {
        let object = self.moving() || (10..=32).contains(&self.class);
        self.name().filter(|_| object).and_then(kind)
    }
}

/// File of a sweep's labels in a sequence's folder.
pub fn file(sequence: &Path, frame: u64) -> PathBuf {
    sequence.join(format!("labels/{frame:06}.label"))
}

/// Reads the labels of the `points` returns of a sweep, in the order of its `.bin`.
///
/// Fails if the file cannot be read or has labels for a different number of returns.
pub fn read(path: &Path, points: usize) -> Result<Vec<PointLabel>, Error> {
    let size = fs::metadata(path).map_err(Error::reading(path))?.len();
    if size != 4 * points as u64 {
        let what = format!("{size} bytes are not the labels of {points} returns, 4 bytes each");
        return Err(Error::input(path, "", what));
    }
    let mut bytes = Vec::with_capacity(4 * points);
    let file = File::open(path).map_err(Error::reading(path))?;
    file.take(size).read_to_end(&mut bytes).map_err(Error::reading(path))?;
    let (words, _) = bytes.as_chunks::<4>();
    let halves = |w: &[u8; 4]| {
        let [class, instance] = [[w[0], w[1]], [w[2], w[3]]].map(u16::from_le_bytes);
        PointLabel { class, instance }
    };
    Ok(words.iter().map(halves).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    #[test]
    fn words_are_split() {
        let t = Scratch::new();
        let words = [252u32 | 7 << 16, 40, 30, 5000];
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        t.write("labels/000003.label", &bytes);
        let labels = read(&file(t.path(), 3), 4).unwrap();
        assert_eq!(labels[0], PointLabel { class: 252, instance: 7 });
        assert_eq!((labels[0].name(), labels[0].moving()), (Some("moving-car"), true));
        let kinds: Vec<_> = labels.iter().map(|l| l.kind()).collect();
        assert_eq!(kinds, [Some(Kind::Car), None, Some(Kind::Pedestrian), None]);
        assert_eq!((labels[3].name(), labels[2].moving()), (None, false));
    }

    #[test]
    fn every_class_of_objects_has_a_kind() {
        for (class, name) in CLASSES {
            let label = PointLabel { class, instance: 0 };
            let object = (10..=32).contains(&class) || class >= 252;
            assert_eq!(label.kind().is_some(), object, "{name}");
        }
    }

    #[test]
    fn a_different_number_of_returns() {
        let t = Scratch::new();
        let path = t.write("labels/000000.label", [0; 10]);
        let e = read(&path, 3).unwrap_err().to_string();
        assert!(e.ends_with("10 bytes are not the labels of 3 returns, 4 bytes each"), "{e}");
        assert!(read(&path, 2).is_err() && read(&t.path().join("absent"), 0).is_err());
        assert!(read(&t.write("empty.label", []), 0).unwrap().is_empty());
    }
}
