//! The voxels a ray passes through.

/// The voxels a ray passes through, start included and end excluded: Bresenham's walk in three
/// dimensions, in integers. The axis of the longest extent steps every time, the others when their
/// error says so.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// Voxel about to be visited.
    pub voxel: [i32; 3],
    step: [i32; 3],
    rise: [i32; 3],
    error: [i32; 3],
    fall: i32,
    left: i32,
}

impl Walk {
    /// From `start` towards `end`, at most `limit` voxels.
    pub fn new(start: [i32; 3], end: [i32; 3], limit: i32) -> Walk {
        let delta = [end[0] - start[0], end[1] - start[1], end[2] - start[2]];
        let extent = delta.map(i32::abs);
        let length = extent[0].max(extent[1]).max(extent[2]);
        Walk {
            voxel: start,
            step: delta.map(i32::signum),
            rise: extent.map(|e| 2 * e),
            error: extent.map(|e| 2 * e - length),
            fall: 2 * length,
            left: length.min(limit),
        }
    }

    /// Whether the walk towards its end is cut short by the limit, so that nothing ends there.
    pub fn beyond(start: [i32; 3], end: [i32; 3], limit: i32) -> bool {
        (0..3).any(|a| (end[a] - start[a]).abs() > limit)
    }
}

impl Iterator for Walk {
    type Item = [i32; 3];

    #[inline]
    fn next(&mut self) -> Option<[i32; 3]> {
        if self.left == 0 {
            return None;
        }
        self.left -= 1;
        let here = self.voxel;
        for a in 0..3 {
            if self.error[a] >= 0 {
                self.voxel[a] += self.step[a];
                self.error[a] -= self.fall;
            }
            self.error[a] += self.rise[a];
        }
        Some(here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_is_connected_and_reaches_its_end() {
        for end in [[7, 3, -2], [-4, 9, 1], [0, 0, 5], [3, 3, 3], [-6, 0, 0], [5, -5, 2]] {
            let mut walk = Walk::new([1, 2, 3], end, 1000);
            let mut last = [1, 2, 3];
            let mut count = 0;
            for v in walk.by_ref() {
                assert!((0..3).all(|a| (v[a] - last[a]).abs() <= 1));
                last = v;
                count += 1;
            }
            assert_eq!(walk.voxel, end, "the next voxel would be the end");
            assert_eq!(count, (0..3).map(|a| (end[a] - [1, 2, 3][a]).abs()).max().unwrap());
            // No voxel is farther than half a cell from the straight line, on any axis.
            for (n, v) in Walk::new([1, 2, 3], end, 1000).enumerate() {
                for a in 0..3 {
                    let line = n as f64 * (end[a] - [1, 2, 3][a]) as f64 / count as f64;
                    assert!(((v[a] - [1, 2, 3][a]) as f64 - line).abs() <= 0.5 + 1e-9);
                }
            }
        }
        assert_eq!(Walk::new([0; 3], [0; 3], 10).count(), 0);
        assert_eq!(Walk::new([0; 3], [20, 0, 0], 10).count(), 10);
        assert!(Walk::beyond([0; 3], [11, 0, 0], 10) && !Walk::beyond([0; 3], [10, 0, 0], 10));
    }
}
