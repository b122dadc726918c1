//! Verdicts on returns: by labelled boxes or exact truth, and by the classes of SemanticKITTI.

use super::classes::{self, EncodedCounts};
use super::{MotionCounts, share};
use crate::eval::collect::PairData;
use crate::eval::objects::Present;
use crate::labels::semantic_kitti::{self as labels, PointLabel};
use crate::labels::{Motion, View};
use crate::report::{Cell, Table, TableRow};
use crate::simulate::truth::PointTruth;
use glam::DVec3;
use raywake_io::Error;
use raywake_io::source::{Source, SweepData, recognise};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Counts of a drive's returns.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReturnCounts {
    /// Those in view, by the boxes.
    pub in_boxes: MotionCounts,
    /// By SemanticKITTI's class: number of returns, and of those reported as moving.
    pub classes: BTreeMap<u16, [u64; 2]>,
    /// By SemanticKITTI's class and the encoder's.
    pub encoded: BTreeMap<u16, EncodedCounts>,
}

/// Counts the returns of one drive.
pub struct ReturnVerdicts {
    view: View,
    margin_m: f64,
    semantic: Option<Semantic>,
    /// Counts so far.
    pub counts: ReturnCounts,
}

impl ReturnVerdicts {
    /// Nothing counted yet.
    pub fn new(view: View, margin_m: f64, semantic: Option<Semantic>) -> ReturnVerdicts {
        ReturnVerdicts { view, margin_m, semantic, counts: ReturnCounts::default() }
    }

    /// Counts the returns of a pair's first sweep, with whether each was reported as moving,
    /// against exact truth if there is any. `mover_m` gives how far a point of the vehicle frame is
    /// from what moves. Fails if its classes cannot be read.
    pub fn pair(
        &mut self,
        seen: &PairData,
        present: &[Present],
        exact: Option<&[PointTruth]>,
        reported: &[bool],
        mover_m: impl Fn(DVec3) -> f32,
    ) -> Result<(), Error> {
        let next_from_world = seen.then.inverse();
        for (n, (point, reported)) in seen.first.points.iter().zip(reported).enumerate() {
            let at = DVec3::from_array(point.position.map(f64::from));
            if !at.is_finite() || !self.view.holds(at) {
                continue;
            }
            let object = match exact {
                Some(returns) => present.iter().find(|p| p.id == Some(returns[n].object)),
                None => present.iter().find(|p| p.holds(at, self.margin_m)),
            };
            let there = object.map_or(Some(seen.now()), |o| Some(o.step?.raw * seen.now()));
            let stays = |by| self.view.holds((next_from_world * by).transform(at));
            let Some(moves) = moves(object).filter(|_| there.is_some_and(stays)) else { continue };
            // The distance matters only for false motion.
            let mover_m = if *reported { mover_m(at) } else { 0.0 };
            self.counts.in_boxes.add(moves, *reported, mover_m);
        }
        let Some(semantic) = &self.semantic else { return Ok(()) };
        let labels = semantic.returns(&seen.first)?;
        for ((label, reported), flow) in labels.iter().zip(reported).zip(&seen.points) {
            let [all, moving] = self.counts.classes.entry(label.class).or_default();
            *all += 1;
            *moving += u64::from(*reported);
            self.counts.encoded.entry(label.class).or_default()[classes::index(flow.class)] += 1;
        }
        Ok(())
    }
}

/// Whether a return of an object moves; `None` if unknown.
fn moves(object: Option<&Present>) -> Option<bool> {
    match object.map(|o| o.motion) {
        Some(Motion::Moving) => Some(true),
        Some(Motion::Slow) => None,
        Some(Motion::Parked) | None => Some(false),
    }
}

/// SemanticKITTI's labels beside a drive.
pub struct Semantic(PathBuf);

impl Semantic {
    /// The labels of the drive in a folder; `None` if its first sweep has none.
    pub fn of(drive: &Path, source: &dyn Source) -> Option<Semantic> {
        let drive = recognise(drive).map_or_else(|_| drive.to_path_buf(), |found| found.1);
        labels::file(&drive, source.frame(0)).is_file().then_some(Semantic(drive))
    }

    /// Labels of a sweep's returns.
    pub fn returns(&self, sweep: &SweepData) -> Result<Vec<PointLabel>, Error> {
        labels::read(&labels::file(&self.0, sweep.frame), sweep.points.len())
    }
}

/// The classes of all drives.
#[derive(Default)]
struct ClassSums {
    /// Number of returns, and of those reported as moving.
    classes: BTreeMap<u16, [u64; 2]>,
    /// The same for static and for moving returns.
    of_motion: [[u64; 2]; 2],
}

impl ClassSums {
    fn add(&mut self, of_drive: &BTreeMap<u16, [u64; 2]>) {
        let has_motion_labels = of_drive.keys().any(|class| PointLabel::of_class(*class).moving());
        for (&class, counts) in of_drive {
            let add = |sum: &mut [u64; 2]| sum.iter_mut().zip(counts).for_each(|(s, n)| *s += n);
            add(self.classes.entry(class).or_default());
            if let Some(moves) = class_moves(PointLabel::of_class(class), has_motion_labels) {
                add(&mut self.of_motion[usize::from(moves)]);
            }
        }
    }

    fn note(&self) -> String {
        let [[_, wrong], [moving, found]] = self.of_motion;
        if moving == 0 {
            return "Whether vehicles and people move is not labelled: they count neither as static \
                nor as moving."
                .into();
        }
        let iou = 100.0 * share(found, moving + wrong);
        format!("Moving object segmentation: IoU {iou:.1} % of all labelled returns.")
    }
}

/// Whether the returns of a class move; `None` if unknown. If a drive's moving objects have no
/// classes of their own, nothing is known about objects that could move.
fn class_moves(label: PointLabel, has_motion_labels: bool) -> Option<bool> {
    let known = has_motion_labels || label.kind().is_none();
    (known && !label.is_unlabelled()).then_some(label.moving())
}

/// False motion by SemanticKITTI's classes; `None` if no drive has any.
pub fn semantic_kitti<'a>(drives: impl Iterator<Item = &'a ReturnCounts>) -> Option<Table> {
    let mut sums = ClassSums::default();
    drives.for_each(|drive| sums.add(&drive.classes));
    if sums.classes.is_empty() {
        return None;
    }
    let row = |name: &str, [all, moving]: [u64; 2]| {
        let percent = Cell::Number(100.0 * share(moving, all), 2);
        TableRow::new([name.into(), Cell::Count(all), Cell::Count(moving), percent])
    };
    let classes = sums
        .classes
        .iter()
        .map(|(&class, &counts)| row(&PointLabel::of_class(class).describe(), counts));
    let motions = ["all static", "all moving"].into_iter().zip(sums.of_motion);
    let motions = motions.filter(|(_, counts)| counts[0] > 0).map(|(name, c)| row(name, c));
    let caption = "Returns reported as moving, by SemanticKITTI's classes.";
    let columns = ["Class", "Returns", "Reported as moving", "Reported as moving, %"];
    let rows = classes.chain(motions).collect();
    Some(Table::new("semantic-kitti", caption, &columns, rows).note(&sums.note()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;
    use raywake_core::encoder::ColumnClass;
    use raywake_core::output::PointFlow;
    use raywake_core::pose::Pose;
    use raywake_core::sweep::Point;

    fn drive(classes: &[(u16, [u64; 2])]) -> ReturnCounts {
        ReturnCounts { classes: classes.iter().copied().collect(), ..ReturnCounts::default() }
    }

    #[test]
    fn classes_with_and_without_motion_labels() {
        assert!(semantic_kitti([drive(&[])].iter()).is_none());
        let merged = drive(&[(0, [90, 9]), (10, [50, 20]), (40, [200, 3]), (50, [100, 1])]);
        let table = semantic_kitti([&merged].into_iter()).unwrap();
        assert_eq!(table.rows.len(), 5);
        assert!(format!("{:?}", table.rows[4]).contains("Count(300), Count(4)"));
        let known = drive(&[(1, [7, 7]), (10, [50, 2]), (252, [40, 30])]);
        let both = semantic_kitti([merged, known].iter()).unwrap();
        assert!(format!("{:?}", both.rows[6]).contains("Count(350), Count(6)"), "{both:?}");
        assert!(format!("{:?}", both.rows[7]).contains("Count(40), Count(30)"), "{both:?}");
        // 30 of 40 that move and 6 static ones.
        assert!(both.notes[0].contains("65.2 %"), "{:?}", both.notes);
    }

    #[test]
    fn returns_are_counted_by_class() {
        let scratch = Scratch::new();
        let words = [50u32, 50 | 3 << 16, 10, 0].map(u32::to_le_bytes);
        scratch.write("labels/000004.label", words.as_flattened());
        let first = SweepData { frame: 4, points: vec![Point::default(); 4], ..Default::default() };
        let mut points = vec![PointFlow::default(); 4];
        points[1].class = Some(ColumnClass::Structure);
        let columns = Vec::new();
        let seen = PairData { index: 0, first, then: Pose::IDENTITY, dt_s: 0.1, columns, points };
        let semantic = Some(Semantic(scratch.path().to_path_buf()));
        let mut verdicts = ReturnVerdicts::new(View::Nowhere, 0.0, semantic);
        verdicts.pair(&seen, &[], None, &[true, false, true, false], |_| f32::INFINITY).unwrap();
        let classes: Vec<_> = verdicts.counts.classes.into_iter().collect();
        assert_eq!(classes, [(0, [1, 0]), (10, [1, 1]), (50, [2, 1])]);
        let encoded = verdicts.counts.encoded[&50];
        assert_eq!((encoded[1], encoded.iter().sum::<u64>()), (1, 2));
        assert_eq!(verdicts.counts.in_boxes, MotionCounts::default());
    }
}
