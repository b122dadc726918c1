//! All metrics of one estimate.

use super::{AccuracyTable, BucketedEpe, Pair, Rules, ScoreError, ThreeWayEpe};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grades {
    pub bucketed: BucketedEpe,
    /// Three-way error.
    pub three_way: ThreeWayEpe,
    /// Accuracies and outliers, without the vehicle's motion.
    pub over_ground: AccuracyTable,
    pub with_ego_motion: AccuracyTable,
}

impl Grades {
    pub fn add(
        &mut self,
        pair: &Pair,
        estimate_m: &[[f32; 3]],
        rules: &Rules,
    ) -> Result<(), ScoreError> {
        let mut points = pair.score(estimate_m, rules)?;
        self.bucketed.add(&points);
        self.three_way.add(&points);
        self.over_ground.add(&points);
        for point in &mut points {
            *point = point.with_ego_motion(&pair.second_from_first);
        }
        self.with_ego_motion.add(&points);
        Ok(())
    }
}
