//! Overlaps between paths and fixtures, by the outlines of their boxes on the ground.

use crate::ground::Ground;
use crate::object::Fixture;
use crate::path::Path;
use glam::{DMat3, DVec2, DVec3};

/// Interval between times at which paths are compared, s.
const CHECK_S: f64 = 0.1;
/// Time before and after a drive that is kept clear as well, s: sweeps and their truth extend
/// beyond it.
const BEYOND_S: f64 = 0.2;
/// Anything rising less than this above the ground is stepped or driven over, m.
const STEP_M: f64 = 0.12;

/// A rectangle on the ground.
#[derive(Clone, Copy, Debug)]
struct Outline {
    centre: DVec2,
    /// Unit vector along its length.
    along: DVec2,
    half: DVec2,
}

impl Outline {
    fn new(x: f64, y: f64, yaw: f64, half: DVec2) -> Outline {
        Outline { centre: DVec2::new(x, y), along: DVec2::from_angle(yaw), half }
    }

    fn corners(&self) -> [DVec2; 4] {
        let (l, w) = (self.along * self.half.x, self.along.perp() * self.half.y);
        [l + w, l - w, -l - w, w - l].map(|v| self.centre + v)
    }

    fn touches(&self, other: &Outline) -> bool {
        let to = other.centre - self.centre;
        let reach = self.half.length() + other.half.length();
        if to.length_squared() > reach * reach {
            return false;
        }
        // Convex outlines are apart if they are separated along a normal of one of their sides.
        let extent = |o: &Outline, axis: DVec2| {
            o.half.x * o.along.dot(axis).abs() + o.half.y * o.along.perp().dot(axis).abs()
        };
        let axes = [self.along, self.along.perp(), other.along, other.along.perp()];
        axes.iter().all(|&axis| to.dot(axis).abs() < extent(self, axis) + extent(other, axis))
    }
}

/// The area that a box covers over time.
#[derive(Clone, Debug)]
pub(super) struct SweptArea {
    /// By time; a single one if it never moves.
    outlines: Vec<Outline>,
    /// Lowest and highest corner.
    bounds: [DVec2; 2],
    /// Lower and upper end above the ground, m.
    span: [f64; 2],
}

impl SweptArea {
    fn of(outlines: Vec<Outline>, span: [f64; 2]) -> SweptArea {
        let start = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let bounds = outlines
            .iter()
            .flat_map(Outline::corners)
            .fold(start, |[low, high], corner| [low.min(corner), high.max(corner)]);
        SweptArea { outlines, bounds, span }
    }

    /// Of a box of this length, width and height, enlarged by `margin` all around (m), on a path
    /// during a drive.
    pub(super) fn along(path: &Path, size: [f64; 3], margin: f64, duration_s: f64) -> SweptArea {
        let half = 0.5 * DVec2::new(size[0], size[1]) + margin;
        let steps = ((duration_s + 2.0 * BEYOND_S) / CHECK_S).ceil() as u32 + 1;
        let steps = if path.is_static() { 1 } else { steps };
        let outline = |n: u32| {
            let at = path.at(f64::from(n) * CHECK_S - BEYOND_S);
            Outline::new(at.x, at.y, at.yaw, half)
        };
        SweptArea::of((0..steps).map(outline).collect(), [STEP_M, size[2]])
    }

    /// Of a fixture.
    pub(super) fn under(fixture: &Fixture, ground: &Ground) -> SweptArea {
        let (at, half) = (fixture.pose.translation, fixture.shape.half());
        let turn = fixture.pose.matrix();
        let upright = turn.z_axis.z > 1.0 - 1e-9;
        let around = extents(&turn, half);
        let outline = match upright {
            true => Outline::new(at.x, at.y, fixture.pose.yaw_rad(), half.truncate()),
            false => Outline::new(at.x, at.y, 0.0, around.truncate()),
        };
        let middle = at.z - ground.height(at.x, at.y);
        SweptArea::of(vec![outline], [middle - around.z, middle + around.z])
    }

    /// Whether the two are ever in the same place at the same time.
    pub(super) fn meets(&self, other: &SweptArea) -> bool {
        let apart = |axis: usize| {
            self.bounds[1][axis] < other.bounds[0][axis]
                || other.bounds[1][axis] < self.bounds[0][axis]
        };
        let above = self.span[0] > other.span[1] || other.span[0] > self.span[1];
        if above || apart(0) || apart(1) {
            return false;
        }
        let at = |area: &SweptArea, n: usize| area.outlines[n.min(area.outlines.len() - 1)];
        let count = self.outlines.len().max(other.outlines.len());
        (0..count).any(|n| at(self, n).touches(&at(other, n)))
    }
}

/// Half extents, along the axes, of the box around the rotated one.
fn extents(turn: &DMat3, half: DVec3) -> DVec3 {
    turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::State;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn crossing_at_the_same_time_and_later() {
        let to = |x: f64, y: f64, yaw: f64| {
            let path = Path::from(State { x, y, yaw, speed: 5.0 });
            SweptArea::along(&path, [4.0, 2.0, 1.5], 0.1, 6.0)
        };
        let a = to(0.0, 0.0, 0.0);
        assert!(a.meets(&to(10.0, -10.0, FRAC_PI_2)), "at the same time");
        assert!(!a.meets(&to(10.0, -25.0, FRAC_PI_2)), "later");
        let still = |y: f64, height: f64| {
            SweptArea::along(&Path::stationary(20.0, y, 0.7), [0.2, 0.2, height], 0.0, 6.0)
        };
        assert!(a.meets(&still(1.1, 1.0)) && still(1.1, 1.0).meets(&a), "on the way");
        assert!(!a.meets(&still(1.3, 1.0)), "beside");
        assert!(!a.meets(&still(0.0, 0.1)), "under the wheels");
    }

    #[test]
    fn long_walls_are_as_long_as_they_are() {
        let wall = Outline::new(0.0, 0.0, 0.5, DVec2::new(30.0, 0.1));
        let along = DVec2::from_angle(0.5);
        let near = |far: f64, aside: f64| {
            let at = far * along + aside * along.perp();
            wall.touches(&Outline::new(at.x, at.y, 1.2, DVec2::new(0.5, 0.5)))
        };
        assert!(near(29.0, 0.5) && near(-29.0, -0.5) && !near(20.0, 0.9) && !near(31.5, 0.0));
    }
}
