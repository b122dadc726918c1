//! Trees, bushes and hedges, each made of several clumps of leaves that some of the rays pass
//! through.

use super::Yard;
use crate::object::{Class, Surface};

impl Yard<'_> {
    /// A tree: broad, slender, or a conifer with branches down to the ground.
    pub(super) fn tree(&mut self, x: f64, y: f64) {
        // Sparse and dense trees: the share of rays that pass through a clump.
        let porosity = self.rng.range(0.3, 0.75);
        match self.count(0, 6) {
            0 => self.conifer(x, y, porosity),
            1 => self.crown([x, y], [0.06, 2.2], 0.9, porosity, 3),
            _ => {
                let stem = [self.rng.range(0.1, 0.28), self.rng.range(1.2, 3.2)];
                let (spread, clumps) = (self.rng.range(1.4, 3.2), self.count(4, 11));
                self.crown([x, y], stem, spread, porosity, clumps);
            }
        }
    }

    /// A tree by the kerb: nothing hangs low where people walk and cars park.
    pub(super) fn street_tree(&mut self, x: f64, y: f64) {
        let stem = [self.rng.range(0.06, 0.24), self.rng.range(2.2, 3.4)];
        let (spread, clumps) = (self.rng.range(0.9, 2.6), self.count(3, 9));
        let porosity = self.rng.range(0.3, 0.75);
        self.crown([x, y], stem, spread, porosity, clumps);
    }

    fn crown(&mut self, [x, y]: [f64; 2], stem: [f64; 2], spread: f64, porosity: f64, clumps: u32) {
        let [radius, trunk] = stem;
        self.pole(x, y, radius, trunk + 0.4 * spread);
        for _ in 0..clumps {
            let size = spread * self.rng.range(0.7, 1.3);
            let aside = 0.45 * spread;
            let at = [
                x + self.rng.range(-aside, aside),
                y + self.rng.range(-aside, aside),
                trunk + self.rng.range(-0.3, 0.7 * spread),
            ];
            let flat = self.rng.range(0.6, 1.0);
            let porosity = (porosity + self.rng.range(-0.15, 0.15)).clamp(0.1, 0.85);
            let across = size * self.rng.range(0.8, 1.2);
            self.leaves(at, [size, across, size * flat], porosity);
        }
    }

    fn conifer(&mut self, x: f64, y: f64, porosity: f64) {
        let (height, foot) = (self.rng.range(4.0, 11.0), self.rng.range(1.4, 3.0));
        self.pole(x, y, 0.12, 0.8 * height);
        let count = self.count(3, 6);
        for i in 0..count {
            let up = f64::from(i) / f64::from(count);
            let wide = foot * (1.0 - 0.85 * up);
            let at = [x, y, 0.3 + up * height];
            self.leaves(at, [wide, wide, 1.4 * height / f64::from(count)], 0.8 * porosity);
        }
    }

    /// What grows in a garden: a tree, a bed or a bush.
    pub(super) fn plant(&mut self, x: f64, y: f64) {
        match self.count(0, 9) {
            0 | 1 => self.tree(x, y),
            2..5 => self.bed(x, y),
            _ => self.bush(x, y),
        }
    }

    /// One to six clumps.
    pub(super) fn bush(&mut self, x: f64, y: f64) {
        for _ in 0..self.count(1, 7) {
            let wide = self.rng.range(0.6, 1.6);
            let size = [wide, wide * self.rng.range(0.7, 1.2), self.rng.range(0.5, 1.8)];
            let at = [x + self.rng.range(-0.6, 0.6), y + self.rng.range(-0.5, 0.5), -0.15];
            let porosity = self.rng.range(0.15, 0.6);
            self.leaves(at, size, porosity);
        }
    }

    /// A bed of loose shrubs a few metres across, which returns rays from any depth.
    pub(super) fn bed(&mut self, x: f64, y: f64) {
        let half = [self.rng.range(1.0, 3.0), self.rng.range(0.6, 1.8)];
        let (height, porosity) = (self.rng.range(0.4, 1.6), self.rng.range(0.5, 0.85));
        for _ in 0..self.count(6, 16) {
            let at = [
                x + self.rng.range(-half[0], half[0]),
                y + self.rng.range(-half[1], half[1]),
                self.rng.range(-0.2, 0.3 * height),
            ];
            let wide = self.rng.range(0.4, 1.4);
            let tall = height * self.rng.range(0.5, 1.1);
            self.leaves(at, [wide, wide, tall], porosity);
        }
    }

    /// A hedge along x: trimmed in one piece, or overgrown in pieces of different heights.
    pub(super) fn hedge(&mut self, x: f64, y: f64, length: f64) {
        let (wide, height) = (self.rng.range(0.4, 0.9), self.rng.range(0.7, 2.0));
        let porosity = self.rng.range(0.1, 0.4);
        if self.rng.chance(0.4) {
            let yaw = self.rng.range(-0.03, 0.03);
            let leaves = Surface::porous(0.45, porosity);
            self.cuboid(Class::Vegetation, [x, y], [length, wide, height], yaw, leaves);
            return;
        }
        let mut at = x - 0.5 * length;
        while at < x + 0.5 * length {
            let size = [
                self.rng.range(0.9, 1.8),
                wide * self.rng.range(0.8, 1.5),
                height * self.rng.range(0.75, 1.25),
            ];
            let aside = self.rng.range(-0.1, 0.1);
            self.leaves([at, y + aside, -0.2], size, porosity);
            at += 0.55 * size[0];
        }
    }

    /// Trees and bushes without houses, to some depth.
    pub(super) fn park(&mut self, x: [f64; 2], side: f64) {
        let amount = ((x[1] - x[0]) * 0.9) as u32;
        for _ in 0..amount {
            let (at, back) = (self.rng.range(x[0], x[1]), self.rng.unit());
            let y = side * (self.edge() + 1.2 + 32.0 * back * back);
            if self.in_crossing(at, 2.0) {
                continue;
            }
            match self.count(0, 10) {
                0..5 => self.tree(at, y),
                5..8 => self.bush(at, y),
                _ => self.bed(at, y + 2.0 * side),
            }
        }
    }
}
