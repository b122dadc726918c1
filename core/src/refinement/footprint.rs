//! The ground a moving cluster stands on: the rectangle along its motion that contains its returns.

use super::motion::Motion;

/// A rectangle, voxels.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    /// Unit vector of its first axis.
    along: [f32; 2],
    /// Smallest and largest coordinate along both axes.
    from: [f32; 2],
    to: [f32; 2],
}

impl Default for Footprint {
    fn default() -> Footprint {
        Footprint { along: [1.0, 0.0], from: [f32::INFINITY; 2], to: [f32::NEG_INFINITY; 2] }
    }
}

impl Footprint {
    /// An empty footprint, along a motion.
    pub fn along(motion: &Motion) -> Footprint {
        let by = motion.delta.xy();
        let along = if by.norm() > 0.0 { by.normalize().into() } else { [1.0, 0.0] };
        Footprint { along, ..Footprint::default() }
    }

    fn coordinates(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [c, s] = self.along;
        [c * x + s * y, c * y - s * x]
    }

    /// Grows to contain a place.
    pub fn add(&mut self, at: [f32; 2]) {
        let at = self.coordinates(at);
        self.from = [0, 1].map(|a| self.from[a].min(at[a]));
        self.to = [0, 1].map(|a| self.to[a].max(at[a]));
    }

    /// Whether a place is inside, or outside by no more than `margin`.
    pub fn holds(&self, at: [f32; 2], margin: f32) -> bool {
        let at = self.coordinates(at);
        (0..2).all(|a| at[a] >= self.from[a] - margin && at[a] <= self.to[a] + margin)
    }

    /// Ranges of rows and columns, below `side`, that include all the cells it holds.
    pub fn cells(&self, margin: f32, side: usize) -> [core::ops::Range<usize>; 2] {
        let [c, s] = self.along;
        let half = [0, 1].map(|a| 0.5 * (self.to[a] - self.from[a]) + margin);
        let middle = [0, 1].map(|a| 0.5 * (self.to[a] + self.from[a]));
        let centre = [c * middle[0] - s * middle[1], s * middle[0] + c * middle[1]];
        let reach = [c.abs() * half[0] + s.abs() * half[1], s.abs() * half[0] + c.abs() * half[1]];
        [0, 1].map(|a| {
            let [from, to] = [centre[a] - reach[a], centre[a] + reach[a] + 1.0];
            // A negative or NaN limit becomes the first cell.
            (from as usize).min(side)..(to as usize).min(side)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_lies_along_the_motion() {
        let motion = Motion::around([50.0; 2]).displaced([2.0, 2.0]);
        let mut footprint = Footprint::along(&motion);
        // A side of a car seen along a diagonal, and a corner of its front.
        [[40.0, 40.0], [50.0, 50.0], [48.0, 52.0]].iter().for_each(|at| footprint.add(*at));
        assert!(footprint.holds([44.0, 46.0], 0.0) && footprint.holds([38.5, 41.5], 0.0));
        assert!(!footprint.holds([46.0, 44.0], 0.5) && footprint.holds([45.2, 44.8], 0.5));
        let [rows, columns] = footprint.cells(0.0, 167);
        for (i, j) in (0..167).flat_map(|i| (0..167).map(move |j| (i, j))) {
            let inside = footprint.holds([i as f32 + 0.5, j as f32 + 0.5], 0.0);
            assert!(!inside || rows.contains(&i) && columns.contains(&j), "{i} {j}");
        }
        assert_eq!(Footprint::default().cells(1.0, 167), [0..0, 0..0]);
    }
}
