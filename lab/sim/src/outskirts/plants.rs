//! Trees, bushes and hedges: forked trunks, crowns at the ends of branches, hedges with gaps.

use super::site::{Site, away};
use crate::object::{Class, Surface};
use std::f64::consts::TAU;

impl Site<'_> {
    /// A tree whose trunk forks into branches that end in leaves.
    pub(super) fn forked_tree(&mut self, at: [f64; 2]) {
        let (height, radius) = (self.rng.range(1.6, 4.0), self.rng.range(0.08, 0.35));
        let porosity = self.rng.range(0.35, 0.8);
        self.post(Class::Pole, at, [radius, height]);
        let fork = [at[0], at[1], height - 0.1];
        let (branches, long) = (self.count(3, 8), self.rng.range(1.0, 3.4));
        for n in 0..branches {
            let turn = TAU * (f64::from(n) + self.rng.range(-0.3, 0.3)) / f64::from(branches);
            let out = long * self.rng.range(0.3, 0.9);
            let end = away(at, turn, out);
            let up = height + long * self.rng.range(0.5, 1.1);
            let wood = Surface::matt(0.35);
            self.bar(Class::Pole, [fork, [end[0], end[1], up]], 0.35 * radius, wood);
            let wide = long * self.rng.range(0.7, 1.2);
            self.leaves(end, [wide, wide, 0.8 * wide], up - 0.4 * wide, porosity);
        }
    }

    /// A slender tree with leaves all along its trunk from a certain height.
    pub(super) fn column_tree(&mut self, at: [f64; 2]) {
        let (height, wide) = (self.rng.range(5.0, 12.0), self.rng.range(0.9, 1.9));
        self.post(Class::Pole, at, [trunk_radius(height), 0.9 * height]);
        let (from, porosity) = (self.rng.range(0.8, 2.2), self.rng.range(0.3, 0.7));
        let steps = ((height - from) / wide).ceil() as u32;
        for n in 0..steps {
            let lift = from + (height - from) * f64::from(n) / f64::from(steps);
            let slim = wide * (1.0 - 0.5 * f64::from(n) / f64::from(steps));
            self.leaves(at, [slim, slim, 1.4 * wide], lift, porosity);
        }
    }

    /// A bush of stems spreading from one root, with leaves around each.
    pub(super) fn spread_bush(&mut self, at: [f64; 2]) {
        let (height, porosity) = (self.rng.range(0.6, 2.2), self.rng.range(0.4, 0.85));
        for _ in 0..self.count(3, 7) {
            let end = away(at, self.rng.range(0.0, TAU), self.rng.range(0.1, 0.5) * height);
            let wide = height * self.rng.range(0.35, 0.7);
            let lift = height * self.rng.range(-0.1, 0.45);
            self.leaves(end, [wide, wide, 0.9 * wide], lift, porosity);
        }
    }

    /// A piece of trimmed hedge at (x, y, yaw) of this length, width and height.
    pub(super) fn trimmed_hedge(&mut self, at: [f64; 3], size: [f64; 3]) {
        let leaves = Surface::porous(0.45, self.rng.range(0.08, 0.35));
        self.block(Class::Vegetation, at, size, leaves);
    }
}

/// Radius of the trunk of a slender tree, m.
fn trunk_radius(height: f64) -> f64 {
    0.012 * height + 0.03
}
