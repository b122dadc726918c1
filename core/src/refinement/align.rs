//! How a thing moved between sweeps: its returns laid over those of the other sweeps.

use super::cloud::Cloud;
use crate::params::{COLUMNS_MAX, LEVELS_MAX, REFINEMENT_SWEEPS_MAX};
use crate::record::Column;
use nalgebra::{Matrix2x3, Matrix3, Vector3};

/// Returns of a thing that are laid over, at most; as many of the other sweep are laid back.
pub const SAMPLES: usize = 96;
/// Columns of the other sweep that are looked at, at most.
const THERE: usize = 1024;
/// Steps of Gauss and Newton at most.
const STEPS: usize = 8;
/// The first steps, with the wide kernel, at most.
const WIDE_STEPS: usize = 3;
/// A step that moves by less is the last with its kernel, voxels and radians.
const SMALL: f32 = 0.01;
/// Width of the kernel of Geman and McClure, voxels: in the first steps, and then.
const KERNEL: [f32; 2] = [1.0, 0.35];
/// Standard deviation of a return, voxels.
pub const NOISE: f32 = 0.15;
/// Share of the information of a pair of returns that is its own: neighbours err alike.
const INFORMATION: f32 = 0.25;
/// Standard deviation of the turn between two sweeps, rad.
const TURN: f32 = 0.03;
/// Information on the displacement where nothing is near, voxels^-2.
const HOLD: f32 = 1e-3;
/// Distance from which on a return counts as missed, voxels.
const MISSED: f32 = 0.5;
/// Nothing is nearer than the vehicle's own sides, voxels: see [`Thing::range`].
const RANGE_MIN: f32 = 7.0;
/// Distance up to which a return counts as met, voxels.
const TOUCHING: f32 = 0.15;

/// What a return tells of the surface it lies on, the upper half of a symmetric matrix: the inverse
/// covariance of the returns around it and of their noise, relative to the noise's. 1 across a
/// surface, little along it.
pub type Weight = [f32; 6];

/// A return of a thing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Voxels from the window's corner of its sweep.
    pub at: [f32; 3],
    /// Sensor that saw it.
    pub sensor: u32,
    /// When, s after the stamp of its sweep.
    pub offset_s: f32,
    /// Its index in the cloud of its sweep.
    pub index: u32,
}

/// Squared distance across the surface, voxels².
fn square(weight: &Weight, [x, y, z]: [f32; 3]) -> f32 {
    let [xx, xy, xz, yy, yz, zz] = *weight;
    x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z
}

/// Another sweep: where its window lies seen from the first one's, and how much of the motion over
/// the pair has happened from stamp to stamp.
#[derive(Clone, Copy)]
pub struct Other<'a> {
    pub nth: usize,
    pub cloud: &'a Cloud,
    pub offset: [f32; 3],
    pub scale: f32,
}

impl Other<'_> {
    /// How much of a motion over the pair has happened when a thing is seen in this sweep.
    fn share(&self, motion: &Motion) -> f32 {
        self.scale + motion.late[self.nth]
    }
}

/// Rigid motion in the plane over one pair of sweeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Displacement of the centre, voxels, and turn about it, rad.
    pub by: Vector3<f32>,
    /// Centre, voxels from the first sweep's window corner.
    pub centre: [f32; 2],
    /// Covariance of `by`.
    pub covariance: Matrix3<f32>,
    /// How much later after its stamp each other sweep sees it, in spans of the pair: one that
    /// passes by is not seen at the same time of every turn.
    pub late: [f32; OTHERS],
}

impl Motion {
    /// No motion of what lies around a centre.
    pub fn around(centre: [f32; 2]) -> Motion {
        Motion { centre, ..Motion::default() }
    }

    /// The same, displaced.
    pub fn by(self, by: [f32; 2]) -> Motion {
        Motion { by: Vector3::new(by[0], by[1], 0.0), ..self }
    }

    /// Displacement of a place, voxels.
    pub fn of(&self, at: [f32; 2]) -> [f32; 2] {
        let [x, y] = [at[0] - self.centre[0], at[1] - self.centre[1]];
        [self.by.x - self.by.z * y, self.by.y + self.by.z * x]
    }

    /// Covariance of the displacement of a place (xx, xy, yy), voxels².
    pub fn covariance_of(&self, at: [f32; 2]) -> [f32; 3] {
        let [x, y] = [at[0] - self.centre[0], at[1] - self.centre[1]];
        let j = Matrix2x3::new(1.0, 0.0, -y, 0.0, 1.0, x);
        let c = j * self.covariance * j.transpose();
        [c[(0, 0)], c[(0, 1)], c[(1, 1)]]
    }
}

/// Sweeps that a thing is laid over.
pub const OTHERS: usize = REFINEMENT_SWEEPS_MAX - 1;

type Samples = heapless::Vec<Sample, SAMPLES>;

/// What a thing is laid over.
#[derive(Clone, Copy)]
pub struct Sweeps<'a> {
    /// The pair's first sweep, which the things are of.
    pub first: &'a Cloud,
    /// The pair's second sweep, then earlier ones.
    pub others: &'a [Other<'a>],
    /// Columns of the first sweep in the second's window.
    pub before: &'a [Column],
    /// Columns of the second sweep.
    pub now: &'a [Column],
    /// From the pair's first stamp to the second, s.
    pub span_s: f32,
}

impl Sweeps<'_> {
    /// Whether rays passed through the voxel of a place of the second sweep's window, and none ended
    /// there: what was there is gone, or has come.
    fn is_free(&self, columns: &[Column], at: [f32; 3]) -> bool {
        let side = self.first.side as f32;
        let inside = at[0] >= 0.0 && at[0] < side && at[1] >= 0.0 && at[1] < side;
        let in_levels = at[2] >= 0.0 && at[2] < LEVELS_MAX as f32;
        inside
            && in_levels
            && columns[at[0] as usize * self.first.side + at[1] as usize][0] >> at[2] as u32 & 1
                != 0
    }

    /// Misfit of a return of the first sweep, if it moved.
    pub fn moving(&self, s: &Sample, motion: &Motion) -> f32 {
        off(self.first, s, motion, &self.others[0])
    }

    /// Misfit of a return of the first sweep, if it stood: nothing where it cannot be seen.
    pub fn standing(&self, s: &Sample) -> Option<f32> {
        let other = &self.others[0];
        let at = moved(s, &Motion::default(), other);
        let found = other.cloud.nearest(at, s.sensor, TOUCHING);
        (found.is_some() || self.is_free(self.now, at)).then(|| truncated(self.first, s, at, found))
    }
}

/// A thing: its columns and some of its returns, and what they are laid over.
pub struct Thing<'a> {
    pub sweeps: Sweeps<'a>,
    pub columns: &'a [u32],
    /// Some of its returns, evenly taken.
    pub samples: Samples,
    /// Their mean, voxels from the first sweep's window corner.
    pub centre: [f32; 2],
    /// Largest extent along an axis, voxels.
    pub extent: f32,
}

/// Marks columns that were seen, a bit each: small enough for a stack.
pub struct Visits([u64; COLUMNS_MAX.div_ceil(64)]);

impl Visits {
    pub fn new() -> Visits {
        Visits([0; COLUMNS_MAX.div_ceil(64)])
    }

    /// Whether a column was not marked yet, which it is now.
    fn first(&mut self, column: usize) -> bool {
        let (word, bit) = (&mut self.0[column / 64], 1 << (column % 64));
        let first = *word & bit == 0;
        *word |= bit;
        first
    }

    /// Whoever marked columns has to take them back.
    fn forget(&mut self, columns: &[u32]) {
        columns.iter().for_each(|c| self.0[*c as usize / 64] &= !(1 << (c % 64)));
    }
}

fn moved(s: &Sample, motion: &Motion, other: &Other) -> [f32; 3] {
    let d = motion.of([s.at[0], s.at[1]]);
    let share = other.share(motion);
    [
        s.at[0] + share * d[0] + other.offset[0],
        s.at[1] + share * d[1] + other.offset[1],
        s.at[2] + other.offset[2],
    ]
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A mean as it grows, 0 of nothing.
#[derive(Default)]
pub struct Mean {
    sum: f32,
    count: f32,
}

impl Mean {
    pub fn add(&mut self, value: f32) {
        self.sum += value;
        self.count += 1.0;
    }

    pub fn value(&self) -> f32 {
        self.sum / self.count.max(1.0)
    }
}

/// Truncated squared distance of a moved return from what another sweep has there, 0 to 1.
fn off(of: &Cloud, s: &Sample, motion: &Motion, other: &Other) -> f32 {
    let at = moved(s, motion, other);
    truncated(of, s, at, other.cloud.nearest(at, s.sensor, TOUCHING))
}

/// Squared distance of a return of the cloud `of` from what was found, 0 to 1: all that is missed
/// counts the same.
fn truncated(of: &Cloud, s: &Sample, at: [f32; 3], found: Option<(f32, Sample)>) -> f32 {
    let Some((d2, q)) = found else { return 1.0 };
    // So near that the surface hardly matters.
    if d2 < TOUCHING * TOUCHING {
        return 0.0;
    }
    (square(&of.weight(s.index), minus(q.at, at)) / (MISSED * MISSED)).min(1.0)
}

impl<'a> Thing<'a> {
    /// Of some columns.
    pub fn new(sweeps: Sweeps<'a>, columns: &'a [u32]) -> Thing<'a> {
        let first = sweeps.first;
        let returns = || columns.iter().flat_map(|c| first.column(*c as usize));
        let stride = returns().count().div_ceil(SAMPLES).max(1);
        // As many as there is room for.
        let samples: Samples = returns().step_by(stride).map(|n| first.sample(n)).collect();
        let count = samples.len() as f32;
        let along = |a: usize| samples.iter().map(move |s| s.at[a]);
        let centre = [0, 1].map(|a| along(a).sum::<f32>() / count);
        let extent = [0, 1].map(|a| {
            along(a).fold(f32::NEG_INFINITY, f32::max) - along(a).fold(f32::INFINITY, f32::min)
        });
        let extent = extent[0].max(extent[1]);
        Thing { sweeps, columns, samples, centre, extent }
    }

    /// Distance from the middle of the window, where the vehicle is, voxels, [`RANGE_MIN`] at least.
    pub fn range(&self) -> f32 {
        let middle = 0.5 * self.sweeps.first.side as f32;
        let [x, y] = self.centre.map(|c| c - middle);
        libm::sqrtf(x * x + y * y).max(RANGE_MIN)
    }

    /// Returns of the newest sweep where the thing would be.
    fn there(&self, motion: &Motion, visits: &mut Visits) -> Samples {
        let other = &self.sweeps.others[0];
        let side = self.sweeps.first.side;
        let mut there = Samples::new();
        let mut list = heapless::Vec::<u32, THERE>::new();
        let mut total = 0;
        'columns: for &c in self.columns {
            let at = [(c as usize / side) as f32 + 0.5, (c as usize % side) as f32 + 0.5];
            let d = motion.of(at);
            let i = (at[0] + d[0] + other.offset[0]) as i32;
            let j = (at[1] + d[1] + other.offset[1]) as i32;
            for a in i.saturating_sub(1).max(0)..i.saturating_add(2).min(side as i32) {
                for b in j.saturating_sub(1).max(0)..j.saturating_add(2).min(side as i32) {
                    let column = a as usize * side + b as usize;
                    let n = other.cloud.column(column).len();
                    if list.is_full() {
                        // Of a thing as large as that the first columns tell enough.
                        break 'columns;
                    }
                    if n > 0 && visits.first(column) {
                        let _ = list.push(column as u32);
                        total += n;
                    }
                }
            }
        }
        visits.forget(&list);
        let stride = total.div_ceil(SAMPLES).max(1);
        let mut seen = 0;
        for &c in &list {
            for n in other.cloud.column(c as usize) {
                if seen % stride == 0 {
                    let _ = there.push(other.cloud.sample(n));
                }
                seen += 1;
            }
        }
        there
    }

    /// Where a return of the newest sweep was, voxels of the first sweep's window.
    fn back(&self, q: &Sample, motion: &Motion) -> [f32; 3] {
        let other = &self.sweeps.others[0];
        let share = other.share(motion);
        let at = minus(q.at, other.offset);
        let d = motion.of([at[0] - share * motion.by.x, at[1] - share * motion.by.y]);
        [at[0] - share * d[0], at[1] - share * d[1], at[2]]
    }

    /// Mean truncated squared distance, 0 (all lie on something) to 1 (none does).
    pub fn misfit(&self, motion: &Motion, visits: &mut Visits) -> f32 {
        let mut mean = Mean::default();
        for other in self.sweeps.others {
            for s in &self.samples {
                mean.add(off(self.sweeps.first, s, motion, other));
            }
        }
        for q in &self.there(motion, visits) {
            let at = self.back(q, motion);
            let found = self.sweeps.first.nearest(at, q.sensor, TOUCHING);
            let off = truncated(self.sweeps.others[0].cloud, q, at, found);
            // What stands there was there before.
            if off < 0.5 || !self.stood(q) {
                mean.add(off);
            }
        }
        mean.value()
    }

    /// The same if it stood, by what can be seen, 0 where nothing can; and the share of its returns
    /// that can be seen in the second sweep.
    pub fn standing(&self, visits: &mut Visits) -> (f32, f32) {
        let mut mean = Mean::default();
        self.samples.iter().filter_map(|s| self.sweeps.standing(s)).for_each(|m| mean.add(m));
        let seen = mean.count / self.samples.len().max(1) as f32;
        for other in &self.sweeps.others[1..] {
            let still = Motion::default();
            for s in &self.samples {
                let at = moved(s, &still, other);
                if let Some(found) = other.cloud.nearest(at, s.sensor, TOUCHING) {
                    mean.add(truncated(self.sweeps.first, s, at, Some(found)));
                }
            }
        }
        let still = Motion::around(self.centre);
        for q in &self.there(&still, visits) {
            let at = self.back(q, &still);
            let found = self.sweeps.first.nearest(at, q.sensor, TOUCHING);
            if found.is_some() || self.sweeps.is_free(self.sweeps.before, q.at) {
                mean.add(truncated(self.sweeps.others[0].cloud, q, at, found));
            }
        }
        (mean.value(), seen)
    }

    fn stood(&self, q: &Sample) -> bool {
        let at = self.back(q, &Motion::default());
        self.sweeps.first.nearest(at, q.sensor, TOUCHING).is_some_and(|n| n.0 < MISSED * MISSED)
    }

    /// Lays the thing over the others, starting at `motion`, by every so many of its samples.
    pub fn align(&self, mut motion: Motion, every: usize, visits: &mut Visits) -> Motion {
        let mut there = self.there(&motion, visits);
        let mut wide = WIDE_STEPS;
        for _ in 0..STEPS {
            let kernel = KERNEL[(wide == 0) as usize];
            // Earlier sweeps help once it is nearly right.
            let others =
                &self.sweeps.others[..if wide == 0 { self.sweeps.others.len() } else { 1 }];
            // Something to hold on to where all is missed, and the turn that is likely.
            let mut h = [HOLD, 0.0, 0.0, HOLD, 0.0, 1.0 / (TURN * TURN)];
            let mut g = [0.0, 0.0, -motion.by.z / (TURN * TURN)];
            let mut pair = |weight: &Weight, source: [f32; 3], off: [f32; 3], scale: f32| {
                let fall = 1.0 / (1.0 + square(weight, off) / (kernel * kernel));
                let w = fall * fall * scale * INFORMATION / (NOISE * NOISE);
                let [xx, xy, xz, yy, yz, _] = weight.map(|v| v * w);
                // Rows of the transposed Jacobian: x, y and the turn about the centre.
                let [a, b] = [motion.centre[1] - source[1], source[0] - motion.centre[0]];
                let (tx, ty) = (xx * a + xy * b, xy * a + yy * b);
                h[0] += scale * xx;
                h[1] += scale * xy;
                h[2] += scale * tx;
                h[3] += scale * yy;
                h[4] += scale * ty;
                h[5] += scale * (a * tx + b * ty);
                let fx = xx * off[0] + xy * off[1] + xz * off[2];
                let fy = xy * off[0] + yy * off[1] + yz * off[2];
                g[0] += fx;
                g[1] += fy;
                g[2] += a * fx + b * fy;
            };
            let mut late: [Mean; OTHERS] = Default::default();
            for other in others {
                let share = other.share(&motion);
                for s in self.samples.iter().step_by(every) {
                    let at = moved(s, &motion, other);
                    if let Some((_, q)) = other.cloud.nearest(at, s.sensor, 0.0) {
                        let weight = self.sweeps.first.weight(s.index);
                        pair(&weight, s.at, minus(q.at, at), share);
                        late[other.nth].add(q.offset_s - s.offset_s);
                    }
                }
            }
            let share = self.sweeps.others[0].share(&motion);
            for q in there.iter().step_by(every) {
                let at = self.back(q, &motion);
                if let Some((_, p)) = self.sweeps.first.nearest(at, q.sensor, 0.0) {
                    let weight = self.sweeps.others[0].cloud.weight(q.index);
                    pair(&weight, p.at, minus(at, p.at), share);
                    late[0].add(q.offset_s - p.offset_s);
                }
            }
            let [xx, xy, xt, yy, yt, tt] = h;
            let h = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
            let Some(inverse) = h.try_inverse() else { break };
            let by = inverse * Vector3::from(g);
            motion.by += by;
            motion.covariance = inverse;
            motion.late = late.map(|mean| mean.value() / self.sweeps.span_s);
            let small = by.norm_squared() < SMALL * SMALL;
            if wide == 0 && small {
                break;
            }
            if wide > 0 {
                wide = if small { 0 } else { wide - 1 };
                if wide == 0 {
                    there = self.there(&motion, visits);
                }
            }
        }
        motion
    }
}
