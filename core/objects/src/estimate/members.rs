//! Groups returns by model point: a counting sort.

use super::MODEL_MAX;
use super::observation::Observation;
use crate::RETURNS_MAX;

/// Indices of the returns, grouped by their nearest model point.
pub(super) struct Members {
    indices: [u16; RETURNS_MAX],
    starts: [u16; MODEL_MAX + 1],
}

impl Members {
    pub const fn new() -> Members {
        Members { indices: [0; RETURNS_MAX], starts: [0; MODEL_MAX + 1] }
    }

    /// Groups the returns of a model with this many points.
    pub fn group(&mut self, points: usize, observations: &[Observation]) {
        let starts = &mut self.starts[..=points];
        starts.fill(0);
        for observation in observations {
            starts[usize::from(observation.nearest) + 1] += 1;
        }
        for i in 0..points {
            starts[i + 1] += starts[i];
        }
        for (i, observation) in observations.iter().enumerate() {
            let at = &mut starts[usize::from(observation.nearest)];
            self.indices[usize::from(*at)] = i as u16;
            *at += 1;
        }
        // Every start has advanced to the next one.
        starts.copy_within(..points, 1);
        starts[0] = 0;
    }

    /// Indices of a model point's returns, ascending.
    pub fn of(&self, point: usize) -> &[u16] {
        &self.indices[usize::from(self.starts[point])..usize::from(self.starts[point + 1])]
    }
}
