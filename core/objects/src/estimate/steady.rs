//! Steady motion that lays the returns of a time over each other.
//!
//! Which velocity it was is told by how crisp it makes the cloud: of all velocities that a centroid
//! allows, the one of least entropy over cells (compare 2.6.4). What a Gauss-Newton step does not
//! find from afar, a search over a lattice of velocities does. Along a smooth side all velocities are
//! as crisp, but for where the object ends: the returns that rays pass count once more, by themselves.

use super::returns::Kept;

/// Returns that take part, evenly in time.
const SAMPLES: usize = 1500;
/// Those of them that rays pass, at most, and of how many they count as much as all do.
const EDGES: usize = 500;
const EDGES_ENOUGH: usize = 100;
/// Less of them tell nothing, nor does less time than this, s; more than that is cut about its middle.
const SAMPLES_MIN: usize = 10;
const SPAN_S: [f32; 2] = [0.2, 10.0];
/// Edge of a cell, m; long objects have so many along themselves. Cells are twice as high.
const CELL_M: f32 = 0.3;
const CELLS_ALONG: f32 = 60.0;
/// A centroid goes along an object by so many of its lengths at most while it is seen, and errs by so
/// much anyway, m/s.
const LENGTHS: f32 = 1.3;
const ERR_MPS: f32 = 0.5;
/// Finer lattices about the best velocity, each of half the step and of cells smaller by this factor,
/// and how many steps they reach.
const FINER: usize = 2;
const SMALLER: f32 = 0.7;
const FINE_STEPS: i32 = 2;
/// Slots of the cells' counts: two cells share one now and then, which hardly tells.
const SLOTS: usize = 1 << 14;

/// A steady motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steady {
    /// Mean time, s, and place, m, of the returns.
    pub time_s: f64,
    pub position: [f64; 3],
    /// m/s.
    pub velocity: [f64; 2],
}

/// A return from the middle of them, m and s.
#[derive(Clone, Copy)]
struct Sample {
    at: [f32; 3],
    time_s: f32,
}

/// How many samples there are, and of those that rays pass, which come after them.
#[derive(Clone, Copy)]
struct Count {
    all: usize,
    edges: usize,
}

/// Evenly so many of what there is.
fn evenly(all: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..count).map(move |n| (2 * n + 1) * all / (2 * count))
}

/// The workspace of a search.
pub(super) struct Search {
    samples: [Sample; SAMPLES + EDGES],
    counts: [u16; SLOTS],
    touched: [u16; SAMPLES + EDGES],
    /// What the nth return of a cell adds to the sum of `n ln n`.
    gains: [f32; SAMPLES + EDGES + 1],
}

impl Search {
    pub const fn new() -> Search {
        Search {
            samples: [Sample { at: [0.0; 3], time_s: 0.0 }; SAMPLES + EDGES],
            counts: [0; SLOTS],
            touched: [0; SAMPLES + EDGES],
            gains: [0.0; SAMPLES + EDGES + 1],
        }
    }

    /// The motion of returns, in the order of time, of an object about so long, m. None where there
    /// are too few, or at one time.
    pub fn find(&mut self, kept: &[Kept], length_m: f32) -> Option<Steady> {
        let middle = kept.get(kept.len() / 2)?.time_s;
        let kept = within(kept, middle, 0.5 * SPAN_S[1]);
        let [first, .., last] = kept else { return None };
        let span = last.time_s - first.time_s;
        let count = kept.len().min(SAMPLES);
        if count < SAMPLES_MIN || span < SPAN_S[0] {
            return None;
        }
        let mean = drift(kept);
        let sample = |kept: &Kept| Sample {
            at: core::array::from_fn(|d| (f64::from(kept.position[d]) - mean.position[d]) as f32),
            time_s: (f64::from(kept.time_s) - mean.time_s) as f32,
        };
        for (at, n) in self.samples.iter_mut().zip(evenly(kept.len(), count)) {
            *at = sample(&kept[n]);
        }
        let passed = || kept.iter().filter(|kept| kept.passed.contains(&true));
        let all = passed().count();
        let edges = all.min(EDGES);
        let taken = passed().enumerate().filter(|(n, _)| (n + 1) * edges / all > n * edges / all);
        for (at, (_, kept)) in self.samples[count..].iter_mut().zip(taken) {
            *at = sample(kept);
        }
        let count = Count { all: count, edges };
        let entropy = |n: usize| if n > 0 { n as f32 * libm::logf(n as f32) } else { 0.0 };
        for (n, gain) in self.gains[1..=count.all + edges].iter_mut().enumerate() {
            *gain = entropy(n + 1) - entropy(n);
        }
        let length_m = length_m.max(1.0);
        let mut cell_m = CELL_M.max(length_m / CELLS_ALONG);
        // A step moves the first and the last by a cell.
        let mut step = 2.0 * cell_m / span;
        let reach = libm::ceilf((LENGTHS * length_m / span + ERR_MPS) / step) as i32;
        let mut velocity = self.best(count, mean.velocity, step, reach, cell_m);
        for _ in 0..FINER {
            step *= 0.5;
            cell_m *= SMALLER;
            velocity = self.best(count, velocity, step, FINE_STEPS, cell_m);
        }
        Some(Steady { velocity, ..mean })
    }

    /// The velocity by which cells are fullest, of a lattice about `centre`.
    fn best(
        &mut self,
        count: Count,
        centre: [f64; 2],
        step: f32,
        reach: i32,
        cell: f32,
    ) -> [f64; 2] {
        let mut best = (f32::MIN, centre);
        for i in -reach..=reach {
            for j in -reach..=reach {
                let by = [i, j].map(|n| f64::from(n as f32 * step));
                let velocity = [centre[0] + by[0], centre[1] + by[1]];
                let fullness = self.fullness(count, velocity.map(|v| v as f32), 1.0 / cell);
                if fullness > best.0 {
                    best = (fullness, velocity);
                }
            }
        }
        best.1
    }

    /// Sum of `n ln n` over the cells by a velocity.
    fn fullness(&mut self, count: Count, [vx, vy]: [f32; 2], per_m: f32) -> f32 {
        // Far below any index, so that truncation is downwards.
        const LOW: f32 = 32768.0;
        let index = |value: f32, per_m: f32| (value * per_m + LOW) as u32;
        let mut sums = [0.0; 2];
        let together = count.all + count.edges;
        let samples = self.samples[..together].iter().zip(&mut self.touched).enumerate();
        for (n, (Sample { at: [x, y, z], time_s }, touched)) in samples {
            let is_edge = n >= count.all;
            // Edges are upright; index 0 is no height's.
            let up = if is_edge { 0 } else { index(*z, 0.5 * per_m) };
            let hash = index(x - time_s * vx, per_m).wrapping_mul(0x9e37_79b1)
                ^ index(y - time_s * vy, per_m).wrapping_mul(0x85eb_ca77)
                ^ up.wrapping_mul(0xc2b2_ae3d);
            let slot = (hash ^ (hash >> 15)) as usize % SLOTS;
            self.counts[slot] += 1;
            sums[usize::from(is_edge)] += self.gains[usize::from(self.counts[slot])];
            *touched = slot as u16;
        }
        for &slot in &self.touched[..together] {
            self.counts[usize::from(slot)] = 0;
        }
        let [all, edges] = sums;
        all / count.all as f32 + edges / count.edges.max(EDGES_ENOUGH) as f32
    }
}

/// Those no further from a time than `by`, s.
pub(super) fn within(kept: &[Kept], time_s: f32, by: f32) -> &[Kept] {
    let from = kept.partition_point(|kept| kept.time_s < time_s - by);
    let to = kept.partition_point(|kept| kept.time_s <= time_s + by);
    &kept[from..to]
}

/// Mean of the returns, and how it goes.
fn drift(kept: &[Kept]) -> Steady {
    let count = kept.len() as f64;
    let (mut time_s, mut position) = (0.0, [0.0; 3]);
    for kept in kept {
        time_s += f64::from(kept.time_s) / count;
        for (sum, value) in position.iter_mut().zip(kept.position) {
            *sum += f64::from(value) / count;
        }
    }
    let (mut square, mut moved) = (0.0, [0.0; 2]);
    for kept in kept {
        let after = f64::from(kept.time_s) - time_s;
        square += after * after;
        for (d, moved) in moved.iter_mut().enumerate() {
            *moved += after * (f64::from(kept.position[d]) - position[d]);
        }
    }
    Steady { time_s, position, velocity: moved.map(|moved| moved / square) }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::boxed::Box;
    use std::vec::Vec;

    /// The side and the front of something so long that passes at `velocity`, its front hidden until
    /// the sixth part of ten.
    fn passing(length_m: f32, velocity: [f32; 2]) -> Vec<Kept> {
        let mut random = Random(3);
        let speed = libm::hypotf(velocity[0], velocity[1]);
        let along = velocity.map(|v| v / speed);
        let mut kept = Vec::new();
        for n in 0..1200 {
            let time_s = 0.004 * n as f32;
            let share = random.uniform() as f32;
            let (x, y) = if n >= 720 && n % 4 == 0 {
                (length_m, -2.0 * share)
            } else if n >= 720 {
                (length_m * share, 0.0)
            } else {
                (0.5 * length_m * share, 0.0)
            };
            let [x, y] = [x, y].map(|v| v + 0.02 * random.normal() as f32);
            let position = [
                30.0 + along[0] * x - along[1] * y + velocity[0] * time_s,
                along[1] * x + along[0] * y + velocity[1] * time_s,
                random.uniform() as f32,
            ];
            kept.push(Kept { position, time_s, ..Kept::NONE });
        }
        kept
    }

    #[test]
    fn a_velocity_is_found_where_the_centroid_errs() {
        let mut search = Box::new(Search::new());
        for (length_m, velocity) in [(4.5, [7.0, 2.0]), (12.0, [-6.0, 3.0]), (4.5, [0.3, 0.0])] {
            let kept = passing(length_m, velocity);
            let found = search.find(&kept, length_m).unwrap();
            let off = |[x, y]: [f64; 2]| {
                libm::hypot(x - f64::from(velocity[0]), y - f64::from(velocity[1]))
            };
            assert!(off(found.velocity) < 0.3, "{velocity:?}: {:?}", found.velocity);
            let drift = drift(&kept);
            assert!(off(drift.velocity) > 0.5, "{velocity:?}: {:?}", drift.velocity);
            // Where they are at that time.
            assert!((found.time_s - 2.398).abs() < 1e-3 && found.position == drift.position);
            assert!(search.counts.iter().all(|count| *count == 0));
        }
    }

    /// A smooth side behind a gap: its front shows until it leaves the gap, its rear when it enters.
    #[test]
    fn where_it_ends_tells_how_a_side_moves() {
        let mut search = Box::new(Search::new());
        let mut random = Random(9);
        let [gap, length_m, speed] = [20.0, 22.0, 6.0];
        let mut kept = Vec::new();
        for n in 0..1200 {
            let time_s = 0.004 * n as f32;
            let front = 6.0 + speed * time_s;
            let (from, to) = ((front - length_m).max(0.0), front.min(gap));
            let x = random.between(from, to);
            let ends = [front < gap && x > to - 0.3, front > length_m && x < from + 0.3];
            let position = [x, 30.0 + 0.02 * random.normal() as f32, 1.0];
            kept.push(Kept { position, time_s, passed: ends, ..Kept::NONE });
        }
        let mut speed_of = |kept: &[Kept]| search.find(kept, length_m).unwrap().velocity[0];
        let found = speed_of(&kept);
        assert!((found - f64::from(speed)).abs() < 0.2, "{found}");
        kept.iter_mut().for_each(|kept| kept.passed = [false; 2]);
        let found = speed_of(&kept);
        assert!((found - f64::from(speed)).abs() > 2.0, "{found}");
    }

    #[test]
    fn too_few_or_at_one_time_have_no_velocity() {
        let mut search = Box::new(Search::new());
        let kept = passing(4.5, [7.0, 2.0]);
        assert_eq!(search.find(&[], 4.5), None);
        assert_eq!(search.find(&kept[..SAMPLES_MIN - 1], 4.5), None);
        let at_once: Vec<Kept> = kept.iter().map(|kept| Kept { time_s: 1.0, ..*kept }).collect();
        assert_eq!(search.find(&at_once, 4.5), None);
    }

    #[test]
    fn what_is_wild_takes_no_longer() {
        let mut search = Box::new(Search::new());
        let mut random = Random(5);
        let mut wild: Vec<Kept> = (0..3000)
            .map(|n| {
                let position = [0; 3].map(|_| 1e5 * random.normal() as f32);
                Kept { position, time_s: 30.0 * n as f32, ..Kept::NONE }
            })
            .collect();
        // A day, cut to ten seconds of it, in which there is one return.
        assert_eq!(search.find(&wild, 1e5), None);
        wild.iter_mut().for_each(|kept| kept.time_s *= 1e-4);
        let found = search.find(&wild, 1e5).unwrap();
        assert!(found.velocity.iter().all(|v| v.is_finite()));
    }
}
