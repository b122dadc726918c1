//! Uneven ground: banks and ditches beside a road, waves along it, mounds.
//!
//! Each term of the sum knows its maximum steepness, here and in a neighbourhood, so a ray is
//! followed to the ground in few steps, and nothing wider than [`STEP_M`] is missed.

use crate::bend::Bend;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Shortest step along a ray, m: no feature of a relief is narrower.
const STEP_M: f64 = 0.2;
/// Rays are followed this far, m: farther than any sensor reports.
const FAR_M: f64 = 250.0;
/// Number of secant steps for where a ray meets the ground: on a single slope the first is exact,
/// over an edge the error shrinks by half or more each time.
const SECANTS: u32 = 8;
/// Points closer to the ground than this count as on it, m.
const EXACT_M: f64 = 1e-6;
/// Step of the differences that yield the normal, m.
const NORMAL_M: f64 = 0.05;

/// A term of the height.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Term {
    /// Height by the offset from a line: `[offset, height]` by rising offset, m, linear in between
    /// and level beyond.
    Banks(Bend, Vec<[f64; 2]>),
    /// A sine along x: height (m), length (m) and phase (rad).
    Wave([f64; 3]),
    /// A round hill, one full period of a cosine: centre, radius and height, m.
    Mound([f64; 2], f64, f64),
}

/// Height at a place, and its maximum steepness within a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Local {
    height: f64,
    slope: f64,
    within: f64,
}

/// A sum of terms over a plane.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Relief {
    pub(crate) terms: Vec<Term>,
    /// Axis and half width (m) of the paved part; beyond it, bumps are higher.
    pub(crate) paved: (Bend, f64),
}

impl Term {
    fn local(&self, x: f64, y: f64) -> Local {
        match self {
            Term::Banks(axis, points) => banks(points, axis.offset(x, y)),
            Term::Wave([height, length, phase]) => Local {
                height: height * (TAU * x / length + phase).sin(),
                slope: self.slope(),
                within: f64::INFINITY,
            },
            Term::Mound(centre, radius, height) => {
                let away = (x - centre[0]).hypot(y - centre[1]);
                if away >= *radius {
                    return Local { within: away - radius, ..Local::default() };
                }
                let height = 0.5 * height * (1.0 + (PI * away / radius).cos());
                Local { height, slope: self.slope(), within: f64::INFINITY }
            }
        }
    }

    /// Maximum steepness anywhere.
    fn slope(&self) -> f64 {
        match self {
            Term::Banks(_, points) => {
                let slopes = points.windows(2).map(|p| steepness(p[0], p[1]).abs());
                slopes.fold(0.0, f64::max)
            }
            Term::Wave([height, length, _]) => TAU * height.abs() / length,
            Term::Mound(_, radius, height) => 0.5 * PI * height.abs() / radius,
        }
    }
}

fn steepness(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[1] - a[1]) / (b[0] - a[0])
}

fn banks(points: &[[f64; 2]], offset: f64) -> Local {
    let next = points.partition_point(|p| p[0] <= offset);
    let level = |p: [f64; 2]| Local { height: p[1], slope: 0.0, within: (offset - p[0]).abs() };
    match (next.checked_sub(1).map(|n| points[n]), points.get(next)) {
        (None, None) => Local::default(),
        (None, Some(&first)) => level(first),
        (Some(last), None) => level(last),
        (Some(before), Some(&after)) => {
            let slope = steepness(before, after);
            let height = before[1] + slope * (offset - before[0]);
            let within = (offset - before[0]).min(after[0] - offset);
            Local { height, slope: slope.abs(), within }
        }
    }
}

impl Relief {
    /// Height at a place, m.
    pub(crate) fn height(&self, x: f64, y: f64) -> f64 {
        self.terms.iter().map(|term| term.local(x, y).height).sum()
    }

    /// How much higher bumps are here than on a road.
    pub(crate) fn roughening(&self, x: f64, y: f64) -> f64 {
        let (axis, half) = self.paved;
        1.0 + 2.0 * (axis.offset(x, y).abs() - half).clamp(0.0, 1.0)
    }

    fn local(&self, x: f64, y: f64) -> Local {
        let start = Local { within: f64::INFINITY, ..Local::default() };
        self.terms.iter().map(|term| term.local(x, y)).fold(start, |sum, term| Local {
            height: sum.height + term.height,
            slope: sum.slope + term.slope,
            within: sum.within.min(term.within),
        })
    }

    /// Range at which the ray from `o` above the ground along the unit vector `d` meets it.
    pub(crate) fn reach(&self, o: DVec3, d: DVec3) -> Option<f64> {
        let flat = d.x.hypot(d.y);
        let steepest: f64 = self.terms.iter().map(Term::slope).sum();
        // How fast a ray can approach ground this steep, per metre.
        let closing = |slope: f64| slope * flat - d.z;
        if closing(steepest) <= 0.0 {
            return None;
        }
        let (mut before, mut range) = ([0.0; 2], 0.0);
        while range < FAR_M {
            let at = o + d * range;
            let local = self.local(at.x, at.y);
            let above = at.z - local.height;
            if above <= 0.0 {
                return Some(self.between(o, d, before, [range, above]));
            }
            let near = closing(local.slope);
            let here = if near > 0.0 { above / near } else { f64::INFINITY };
            let here = here.min(local.within / flat.max(f64::MIN_POSITIVE));
            before = [range, above];
            range += here.max(above / closing(steepest)).max(STEP_M);
        }
        None
    }

    /// Where a ray meets the ground between two places on it, each given by range and height above
    /// the ground: one above the ground and one not.
    fn between(&self, o: DVec3, d: DVec3, mut over: [f64; 2], mut under: [f64; 2]) -> f64 {
        for _ in 0..SECANTS {
            let share = over[1] / (over[1] - under[1]).max(f64::MIN_POSITIVE);
            let range = over[0] + share.min(1.0) * (under[0] - over[0]);
            let at = o + d * range;
            let above = at.z - self.height(at.x, at.y);
            // The end that stays counts half; otherwise one end could stay for ever.
            let (moved, stays) =
                if above > 0.0 { (&mut over, &mut under) } else { (&mut under, &mut over) };
            (*moved, stays[1]) = ([range, above], 0.5 * stays[1]);
            if above.abs() < EXACT_M {
                return range;
            }
        }
        under[0]
    }

    /// Cosine between a direction and the normal at a place.
    pub(crate) fn cosine(&self, at: DVec3, d: DVec3) -> f64 {
        let rise = |dx: f64, dy: f64| {
            let [a, b] = [-NORMAL_M, NORMAL_M].map(|s| self.height(at.x + s * dx, at.y + s * dy));
            (b - a) / (2.0 * NORMAL_M)
        };
        let normal = DVec3::new(-rise(1.0, 0.0), -rise(0.0, 1.0), 1.0);
        d.dot(normal).abs() / normal.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    fn relief() -> Relief {
        let axis = Bend { curvature: 0.004 };
        let points =
            vec![[-12.0, 2.5], [-7.0, 0.0], [-5.0, -0.7], [-4.0, 0.0], [4.0, 0.0], [9.0, -3.0]];
        Relief {
            terms: vec![
                Term::Banks(axis, points),
                Term::Wave([0.8, 120.0, 0.3]),
                Term::Mound([15.0, 2.0], 4.0, 1.1),
            ],
            paved: (axis, 4.0),
        }
    }

    #[test]
    fn equals_integration_in_tiny_steps() {
        let (relief, mut rng, mut met) = (relief(), Rng::new(4), 0);
        for _ in 0..3000 {
            let o = DVec3::new(rng.range(-30.0, 10.0), rng.range(-3.0, 3.0), 2.6);
            let d = DVec3::new(rng.bell(), rng.bell(), -0.2 * rng.unit()).normalize();
            let under = |range: f64| {
                let at = o + d * range;
                at.z <= relief.height(at.x, at.y)
            };
            let slow = (0..12_000).map(|n| 0.01 * f64::from(n)).find(|&range| under(range));
            let fast = relief.reach(o, d).filter(|&range| range < 119.0);
            let Some(slow) = slow.filter(|_| fast.is_some()) else {
                // A ray that only grazes the ground may hit by one method and miss by the other.
                assert!(slow.is_none_or(|s| s > 118.0 || !under(s + STEP_M)), "{o} {d} {slow:?}");
                continue;
            };
            let fast = fast.unwrap();
            assert!(fast > slow - 0.011 && (fast < slow + 1e-3 || !under(slow + STEP_M)));
            met += 1;
        }
        assert!(met > 2000, "{met}");
    }

    #[test]
    fn heights_are_continuous_and_within_their_stated_slope() {
        let (relief, mut rng) = (relief(), Rng::new(5));
        for _ in 0..5000 {
            let [x, y] = [0; 2].map(|_| rng.range(-60.0, 60.0));
            let local = relief.local(x, y);
            assert!((local.height - relief.height(x, y)).abs() < 1e-12);
            let turn = rng.range(0.0, TAU);
            let step = local.within.min(0.5);
            let there = relief.height(x + step * turn.cos(), y + step * turn.sin());
            assert!((there - local.height).abs() <= local.slope * step + 1e-9);
        }
    }
}
