//! What the tables distinguish: estimates, truths, classes and motions.

use super::row::{CLASSES, Row, class_of};
use crate::labels::Kind;

/// An estimate compared with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Estimate {
    /// The pipeline's.
    Ours,
    /// The pipeline's, where it found a match; other columns are left out.
    Matched,
    /// Nothing moves relative to the vehicle.
    Zero,
    /// Nothing moves over ground.
    EgoOnly,
    /// The truth in whole cells.
    Rounded,
}

impl Estimate {
    /// All of them, in the order listed.
    pub const ALL: [Estimate; 5] =
        [Estimate::Ours, Estimate::Matched, Estimate::Zero, Estimate::EgoOnly, Estimate::Rounded];

    /// Name for display.
    pub fn label(self) -> &'static str {
        match self {
            Estimate::Ours => "raywake",
            Estimate::Matched => "raywake, matched columns only",
            Estimate::Zero => "zero flow",
            Estimate::EgoOnly => "ego motion only",
            Estimate::Rounded => "truth rounded to cells",
        }
    }

    /// Whether it needs no LIDAR.
    pub fn is_reference(self) -> bool {
        !matches!(self, Estimate::Ours | Estimate::Matched)
    }

    /// Displacement over ground, m; `None` if the column does not count.
    pub fn of(self, row: &Row) -> Option<[f32; 2]> {
        match self {
            Estimate::Ours => Some([row.flow_x, row.flow_y]),
            Estimate::Matched => row.is_matched().then_some([row.flow_x, row.flow_y]),
            Estimate::Zero => Some([row.carried_x, row.carried_y]),
            Estimate::EgoOnly => Some([0.0; 2]),
            Estimate::Rounded => Some([row.rounded_x, row.rounded_y]),
        }
    }
}

/// A truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Truth {
    /// Labels as given: they jitter.
    Raw,
    /// Labels smoothed over time, zero for parked objects.
    Smooth,
}

/// Motion of labelled objects over ground; see [`crate::labels::Motion`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MotionGroup {
    /// Any motion.
    Any,
    /// Moving.
    Moving,
    /// Neither moving nor parked.
    Slow,
    /// Parked.
    Parked,
}

impl MotionGroup {
    /// All of them.
    pub const ALL: [MotionGroup; 4] =
        [MotionGroup::Any, MotionGroup::Moving, MotionGroup::Slow, MotionGroup::Parked];

    /// The motions distinguished for a group: only labelled ones have any.
    pub fn of(group: ClassGroup) -> &'static [MotionGroup] {
        if group == ClassGroup::Class(0) { &[MotionGroup::Any] } else { &MotionGroup::ALL[1..] }
    }

    /// Name for display.
    pub fn label(self) -> &'static str {
        match self {
            MotionGroup::Any => "all",
            MotionGroup::Moving => "moving",
            MotionGroup::Slow => "slow",
            MotionGroup::Parked => "parked",
        }
    }

    fn holds(self, motion: usize) -> bool {
        match self {
            MotionGroup::Any => true,
            MotionGroup::Moving => motion == 2,
            MotionGroup::Slow => motion == 1,
            MotionGroup::Parked => motion == 0,
        }
    }
}

/// A set of classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClassGroup {
    /// One of [`CLASSES`].
    Class(u8),
    /// Everything in a labelled box.
    Labelled,
}

impl ClassGroup {
    /// People on foot.
    pub const PEOPLE: ClassGroup = ClassGroup::Class(class_of(Kind::Pedestrian));

    /// Name for display.
    pub fn label(self) -> &'static str {
        match self {
            ClassGroup::Class(class) => CLASSES[class as usize],
            ClassGroup::Labelled => "All labelled",
        }
    }

    /// Classes of labelled objects, and all of them together.
    pub fn labelled() -> impl Iterator<Item = ClassGroup> {
        (1..CLASSES.len() as u8).map(ClassGroup::Class).chain([ClassGroup::Labelled])
    }

    /// Whether a class of [`CLASSES`] belongs to this group.
    pub fn holds(self, class: usize) -> bool {
        match self {
            ClassGroup::Class(c) => usize::from(c) == class,
            ClassGroup::Labelled => class > 0,
        }
    }
}

/// Number of classes, including what is in no box.
pub const COUNT: usize = CLASSES.len();
/// Indices of the cells selected by a group and a motion.
pub fn cells(group: ClassGroup, motion: MotionGroup) -> impl Iterator<Item = (usize, usize)> {
    let classes = (0..COUNT).filter(move |c| group.holds(*c));
    classes.flat_map(move |c| (0..3).filter(move |m| motion.holds(*m)).map(move |m| (c, m)))
}
