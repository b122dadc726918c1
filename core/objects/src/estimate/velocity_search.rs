//! Steady motion that brings the returns of a period into coincidence.
//!
//! Of all velocities that a centroid allows, the search takes the one that makes the cloud
//! crispest: that of least entropy over cells (compare 2.6.4; Sheehan, Harrison and Newman, 2012).
//! It scans a lattice of velocities, as Gauss-Newton does not find distant minima. Along a smooth
//! side all velocities are equally crisp, except where the object ends: returns that rays pass are
//! counted once more, separately.

use super::params::SearchParams;
use super::samples::Sample;

/// Maximum number of returns used, evenly spaced in time.
const POINTS: usize = 1500;
/// Maximum number of returns that rays pass, used once more.
const EDGES: usize = 500;
/// Slots for the cells' counts: two cells sometimes share one, which hardly matters.
const SLOTS: usize = 1 << 14;

/// A steady motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SteadyMotion {
    /// Mean time, s, and position, m, of the returns.
    pub time_s: f64,
    pub position: [f64; 3],
    /// m/s.
    pub velocity: [f64; 2],
}

/// A return relative to the mean of all, m and s.
#[derive(Clone, Copy)]
struct CentredReturn {
    at: [f32; 3],
    time_s: f32,
}

/// Number of returns used, and of those that rays pass, which come after them.
#[derive(Clone, Copy)]
struct Counts {
    all: usize,
    edges: usize,
}

/// A lattice of velocities around a centre, and the edge of the cells.
struct Lattice {
    /// m/s.
    centre: [f64; 2],
    /// m/s.
    step: f32,
    /// Steps either way.
    reach: i32,
    cell_m: f32,
}

/// Indices of `count` of `all` elements, evenly spaced.
fn evenly(all: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..count).map(move |n| (2 * n + 1) * all / (2 * count))
}

/// The workspace of a search.
pub(super) struct VelocitySearch {
    points: [CentredReturn; POINTS + EDGES],
    counts: [u16; SLOTS],
    touched: [u16; POINTS + EDGES],
    /// What the nth return of a cell adds to the sum of `n ln n`.
    gains: [f32; POINTS + EDGES + 1],
}

impl VelocitySearch {
    pub const fn new() -> VelocitySearch {
        VelocitySearch {
            points: [CentredReturn { at: [0.0; 3], time_s: 0.0 }; POINTS + EDGES],
            counts: [0; SLOTS],
            touched: [0; POINTS + EDGES],
            gains: [0.0; POINTS + EDGES + 1],
        }
    }

    /// Finds the motion of an object about `length_m` long from its returns, in order of time. None
    /// if there are too few, or over too short a time.
    pub fn find(
        &mut self,
        samples: &[Sample],
        length_m: f32,
        params: &SearchParams,
    ) -> Option<SteadyMotion> {
        let middle = samples.get(samples.len() / 2)?.time_s;
        let samples = within(samples, middle, 0.5 * params.search_span_max_s);
        let [first, .., last] = samples else { return None };
        let span = last.time_s - first.time_s;
        let count = samples.len().min(POINTS);
        if count < params.search_returns_min || span < params.search_span_min_s {
            return None;
        }
        let mean = drift(samples);
        let count = self.gather(samples, count, &mean);
        let length_m = length_m.max(1.0);
        let mut cell_m = params.search_cell_m.max(length_m / params.search_cells_along);
        // A step moves the first and the last return by a cell.
        let mut step = 2.0 * cell_m / span;
        let reach_mps = params.search_lengths * length_m / span + params.search_error_mps;
        let reach = libm::ceilf(reach_mps / step) as i32;
        let mut lattice = Lattice { centre: mean.velocity, step, reach, cell_m };
        let mut velocity = self.best(count, &lattice, params);
        for _ in 0..params.search_refinements {
            step *= 0.5;
            cell_m *= params.search_cell_ratio;
            let reach = params.search_refined_steps as i32;
            lattice = Lattice { centre: velocity, step, reach, cell_m };
            velocity = self.best(count, &lattice, params);
        }
        Some(SteadyMotion { velocity, ..mean })
    }

    /// Takes `count` returns and, after them, those that rays pass, relative to a motion.
    fn gather(&mut self, samples: &[Sample], count: usize, mean: &SteadyMotion) -> Counts {
        let centred = |one: &Sample| CentredReturn {
            at: core::array::from_fn(|d| (f64::from(one.position[d]) - mean.position[d]) as f32),
            time_s: (f64::from(one.time_s) - mean.time_s) as f32,
        };
        for (at, n) in self.points.iter_mut().zip(evenly(samples.len(), count)) {
            *at = centred(&samples[n]);
        }
        let passed = || samples.iter().filter(|one| one.passed.contains(&true));
        let all = passed().count();
        let edges = all.min(EDGES);
        let taken = passed().enumerate().filter(|(n, _)| (n + 1) * edges / all > n * edges / all);
        for (at, (_, one)) in self.points[count..].iter_mut().zip(taken) {
            *at = centred(one);
        }
        let entropy = |n: usize| if n > 0 { n as f32 * libm::logf(n as f32) } else { 0.0 };
        for (n, gain) in self.gains[1..=count + edges].iter_mut().enumerate() {
            *gain = entropy(n + 1) - entropy(n);
        }
        Counts { all: count, edges }
    }

    /// The velocity of a lattice with the fullest cells.
    fn best(&mut self, count: Counts, lattice: &Lattice, params: &SearchParams) -> [f64; 2] {
        let Lattice { centre, step, reach, cell_m } = *lattice;
        let mut best = (f32::MIN, centre);
        for i in -reach..=reach {
            for j in -reach..=reach {
                let by = [i, j].map(|n| f64::from(n as f32 * step));
                let velocity = [centre[0] + by[0], centre[1] + by[1]];
                let edges_full = params.search_edges;
                let concentration =
                    self.concentration(count, velocity.map(|v| v as f32), 1.0 / cell_m, edges_full);
                if concentration > best.0 {
                    best = (concentration, velocity);
                }
            }
        }
        best.1
    }

    /// Sum of `n ln n` over the cells at a velocity, per return.
    fn concentration(
        &mut self,
        count: Counts,
        [vx, vy]: [f32; 2],
        per_m: f32,
        edges_full: usize,
    ) -> f32 {
        // Far below any index, so that truncation rounds downwards.
        const LOW: f32 = 32768.0;
        let index = |value: f32, per_m: f32| (value * per_m + LOW) as u32;
        let mut sums = [0.0; 2];
        let together = count.all + count.edges;
        let points = self.points[..together].iter().zip(&mut self.touched).enumerate();
        for (n, (CentredReturn { at: [x, y, z], time_s }, touched)) in points {
            let is_edge = n >= count.all;
            // Edges are upright; no height has index 0.
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
        all / count.all as f32 + edges / count.edges.max(edges_full) as f32
    }
}

/// Samples no farther from a time than `by`, s.
pub(super) fn within(samples: &[Sample], time_s: f32, by: f32) -> &[Sample] {
    let from = samples.partition_point(|one| one.time_s < time_s - by);
    let to = samples.partition_point(|one| one.time_s <= time_s + by);
    &samples[from..to]
}

/// Mean of the returns, and the velocity fitted to them.
fn drift(samples: &[Sample]) -> SteadyMotion {
    let count = samples.len() as f64;
    let (mut time_s, mut position) = (0.0, [0.0; 3]);
    for one in samples {
        time_s += f64::from(one.time_s) / count;
        for (sum, value) in position.iter_mut().zip(one.position) {
            *sum += f64::from(value) / count;
        }
    }
    let (mut square, mut moved) = (0.0, [0.0; 2]);
    for one in samples {
        let after = f64::from(one.time_s) - time_s;
        square += after * after;
        for (d, moved) in moved.iter_mut().enumerate() {
            *moved += after * (f64::from(one.position[d]) - position[d]);
        }
    }
    SteadyMotion { time_s, position, velocity: moved.map(|moved| moved / square) }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    /// The side and the front of an object of this length that passes at `velocity`, its front
    /// hidden for the first six tenths of the time.
    fn passing(length_m: f32, velocity: [f32; 2]) -> Vec<Sample> {
        let mut random = Random(3);
        let speed = libm::hypotf(velocity[0], velocity[1]);
        let along = velocity.map(|v| v / speed);
        let mut samples = Vec::new();
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
            samples.push(Sample { position, time_s, ..Sample::NONE });
        }
        samples
    }

    #[test]
    fn velocity_is_found_where_the_centroid_is_wrong() {
        let mut search = raywake_alloc_guard::boxed!(VelocitySearch, VelocitySearch::new());
        for (length_m, velocity) in [(4.5, [7.0, 2.0]), (12.0, [-6.0, 3.0]), (4.5, [0.3, 0.0])] {
            let samples = passing(length_m, velocity);
            let found = search.find(&samples, length_m, &SearchParams::DEFAULT).unwrap();
            let off = |[x, y]: [f64; 2]| {
                libm::hypot(x - f64::from(velocity[0]), y - f64::from(velocity[1]))
            };
            assert!(off(found.velocity) < 0.3, "{velocity:?}: {:?}", found.velocity);
            let drift = drift(&samples);
            assert!(off(drift.velocity) > 0.5, "{velocity:?}: {:?}", drift.velocity);
            // Where they are at that time.
            assert!((found.time_s - 2.398).abs() < 1e-3 && found.position == drift.position);
            assert!(search.counts.iter().all(|count| *count == 0));
        }
    }

    /// A smooth side behind a gap: its front is visible until it leaves the gap, its rear once it
    /// has entered it.
    #[test]
    fn ends_determine_how_a_side_moves() {
        let mut search = raywake_alloc_guard::boxed!(VelocitySearch, VelocitySearch::new());
        let mut random = Random(9);
        let [gap, length_m, speed] = [20.0, 22.0, 6.0];
        let mut samples = Vec::new();
        for n in 0..1200 {
            let time_s = 0.004 * n as f32;
            let front = 6.0 + speed * time_s;
            let (from, to) = ((front - length_m).max(0.0), front.min(gap));
            let x = random.between(from, to);
            let ends = [front < gap && x > to - 0.3, front > length_m && x < from + 0.3];
            let position = [x, 30.0 + 0.02 * random.normal() as f32, 1.0];
            samples.push(Sample { position, time_s, passed: ends, ..Sample::NONE });
        }
        let mut speed_of = |samples: &[Sample]| {
            search.find(samples, length_m, &SearchParams::DEFAULT).unwrap().velocity[0]
        };
        let found = speed_of(&samples);
        assert!((found - f64::from(speed)).abs() < 0.2, "{found}");
        samples.iter_mut().for_each(|one| one.passed = [false; 2]);
        let found = speed_of(&samples);
        assert!((found - f64::from(speed)).abs() > 2.0, "{found}");
    }

    #[test]
    fn too_few_or_at_one_time_have_no_velocity() {
        let mut search = raywake_alloc_guard::boxed!(VelocitySearch, VelocitySearch::new());
        let samples = passing(4.5, [7.0, 2.0]);
        assert_eq!(search.find(&[], 4.5, &SearchParams::DEFAULT), None);
        assert_eq!(
            search.find(
                &samples[..SearchParams::DEFAULT.search_returns_min - 1],
                4.5,
                &SearchParams::DEFAULT
            ),
            None
        );
        let at_once: Vec<Sample> =
            samples.iter().map(|one| Sample { time_s: 1.0, ..*one }).collect();
        assert_eq!(search.find(&at_once, 4.5, &SearchParams::DEFAULT), None);
    }

    #[test]
    fn implausible_input_takes_no_longer() {
        let mut search = raywake_alloc_guard::boxed!(VelocitySearch, VelocitySearch::new());
        let mut random = Random(5);
        let mut wild: Vec<Sample> = (0..3000)
            .map(|n| {
                let position = [0; 3].map(|_| 1e5 * random.normal() as f32);
                Sample { position, time_s: 30.0 * n as f32, ..Sample::NONE }
            })
            .collect();
        // A day, of which ten seconds are used, with one return in them.
        assert_eq!(search.find(&wild, 1e5, &SearchParams::DEFAULT), None);
        wild.iter_mut().for_each(|one| one.time_s *= 1e-4);
        let found = search.find(&wild, 1e5, &SearchParams::DEFAULT).unwrap();
        assert!(found.velocity.iter().all(|v| v.is_finite()));
    }
}
