//! The scene-flow metrics in current use, on flow per return, equal to the official graders' to one
//! part in a million.
//!
//! | metric | as in |
//! |---|---|
//! | [`BucketedEpe`], [`ThreeWayEpe`] | `bucketed-scene-flow-eval` 2.0.25 (Argoverse 2) |
//! | [`AccuracyTable`] | av2-api (EPE, strict and relaxed accuracy, angle), FlowNet3D (outliers) |
//!
//! A [`Pair`] holds the truth of two sweeps and determines which returns count ([`Rules`]); an
//! estimate gives each a flow, and [`Pair::score`] the list that every metric takes. Metrics are
//! sums: they take pairs one at a time and can be merged with those of another thread.
//!
//! Flow is motion over ground, in metres over the pair, along the axes of the first sweep's
//! vehicle frame: the vehicle's own motion is removed.

mod accuracy;
pub mod argoverse;
mod bucketed;
mod category;
pub mod grade;
mod grades;
mod ground;
mod pair;
mod print;
pub mod reference;
mod speed_table;
mod three_way;

#[cfg(test)]
mod tests;

pub use accuracy::{Accuracy, AccuracyTable, PointMotion};
pub use bucketed::{BucketedEpe, BucketedErrors, ClassError};
pub use category::{Category, Class};
pub use pair::{MOVING_M, NEAR_M, Pair, Rules, ScoreError, Scored, TruePoint};
pub use speed_table::{Bucket, Range, SpeedTable};
pub use three_way::{ThreeWayEpe, ThreeWayErrors};
