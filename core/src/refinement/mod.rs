//! Refinement of the flow below the cell's size: things, and how each of them moved.
//!
//! Cells of 0.3 m bound what whole displacements can tell: this stage goes back to the returns.
//! Returns above the ground are thinned ([`cloud`]); columns that touch make
//! things ([`segments`]); each thing is laid over the other sweep, and over earlier ones where
//! [`crate::params::Profile::refinement_sweeps`] allows, starting from standing still, from what its
//! tracklets predict, from the displacements most of its columns found by energy minimisation, and,
//! where none of these fits, from a search ([`align`]). It moves where that explains the returns far
//! better than standing still does, or, if it moved so before, somewhat better. Then all its columns
//! move with it, those that the background filter took or that found no match too.

mod align;
mod cloud;
mod places;
mod search;
mod segments;
#[cfg(test)]
mod tests;

use crate::params::{COLUMNS_MAX, Profile, REACH, REFINEMENT_SWEEPS_MAX, SIDE};
use crate::pipeline::Perceived;
use crate::prepare::Placed;
use crate::record::{Flow, NONE, Step, VALID, flow_displacement};
use crate::sweep::Point;
use crate::team::{Team, fill};
use align::{Mean, Motion, OTHERS, Other, Sample, Sweeps, Thing, Visits};
use cloud::{Cloud, Scratch};
use segments::Segments;

/// Displacements that many columns found, tried as starts.
const STARTS: usize = 3;
/// A thing that fits its place so well stands: misfits are shares of what could be missed.
const STANDS: f32 = 0.08;
/// A start is first tried by every so many samples, and by all of them where that leads to a better
/// fit than the best so far.
const FEW: usize = 3;
/// A start that leads to so good a fit is the last.
const FITS: f32 = 0.05;
/// Share of [`GAIN`] and [`STANDS`] that will do for what moves as it did before, or as what is beside
/// it; the longer it is before, the less, from this extent on, voxels: its sides slide along themselves.
const AS_BEFORE: f32 = 0.4;
const LONG: f32 = 15.0;
/// Starts as near to each other lead to the same, voxels.
const SAME: f32 = 0.75;
/// A start that fits so badly calls for a search.
const UNFIT: f32 = 0.3;
/// Gain over standing still from which on a thing moves, see [`gain`].
const GAIN: f32 = 0.12;
/// Standard deviation of what stands, before [`doubt`], voxels.
const STILL: f32 = 0.025;
/// Share of its covariance that a perfect fit leaves a thing of one column a voxel away: the nearer it
/// is, the more another side of it comes into view; the smaller, the more its returns err alike.
const CONFIDENCE: f32 = 1.3;
/// The misfit that doubles a variance, see [`doubt`].
const DOUBTFUL: f32 = 0.008;
/// Standard deviation of a motion, as a share of itself, however well it fits: when each return was.
const SHARE: f32 = 0.01;
/// How much more gain makes it e times likelier that a thing moves, see [`Found::unsure`].
const SURER: f32 = 0.04;
/// Variance of whether what stands does where its column's match says otherwise: either may be right.
const MATCHED: f32 = 0.25;
/// Displacement from which on a thing moves, voxels.
const LEAST: f32 = 0.13;
/// Mean misfit of a column's returns from which on it may be part of something that moves.
const RESTLESS: f32 = 0.15;
/// Returns of a column that are looked at for that.
const PROBES: usize = 4;
/// Returns a thing must have to move by itself.
const ENOUGH: usize = 5;
/// Returns a thing must have for a search: fewer fit anywhere.
const SEARCHED: usize = 12;
/// By how much more than standing still a motion may misfit a column beside those it was found for.
const AS_WELL: f32 = 0.03;
/// By how much more than standing still the motion of its larger part may misfit what is left of a
/// thing.
const REST: f32 = 0.05;
/// Share of a thing's extent that a part must have to take the rest along.
const MOST: f32 = 0.5;
/// Share of returns to be seen before standing still is believed.
const SEEN: f32 = 0.5;
/// Larger things stand, voxels: 30 m at 0.30 m.
const EXTENT_MAX: f32 = 100.0;
/// How far a column of low returns may lie from a moving thing whose edge it is, columns, and how
/// far its match from that thing's motion, cells.
const EDGE: i32 = 2;
const ALIKE: f32 = 1.5;
/// How far a fragment may lie from a moving thing that takes it along, columns.
const NEAR: usize = 4;
/// Moving things near a fragment that are tried.
const NEIGHBOURS: usize = 8;

/// How well the explanation of a thing's returns by a motion beats that by standing still.
fn gain(still: f32, moved: f32) -> f32 {
    if moved < still { (1.0 - moved / still) * libm::sqrtf(still - moved) } else { 0.0 }
}

/// How a column moved over the pair, voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refined {
    /// Displacement; zero where it stands.
    pub by: [f32; 2],
    /// Its covariance (xx, xy, yy).
    pub covariance: [f32; 3],
    /// Whether it is part of a thing that moves.
    pub moves: bool,
}

impl Refined {
    /// As part of a thing.
    fn of(found: &Found, at: [f32; 2]) -> Refined {
        let by = found.motion.of(at);
        let unsure = found.unsure + if found.moves { SHARE * SHARE } else { 0.0 };
        let own = match found.moves {
            true => Refined { by, covariance: found.motion.covariance_of(at), moves: true },
            false => Refined::standing(found.still),
        };
        own.between(by, unsure)
    }

    /// As one of two motions `by` apart, of which one is right: so large is the variance of which.
    fn between(self, [x, y]: [f32; 2], variance: f32) -> Refined {
        let apart = [x * x, x * y, y * y];
        let covariance = [0, 1, 2].map(|n| self.covariance[n] + variance * apart[n]);
        Refined { covariance, ..self }
    }

    /// As what stands although its column's match, cells, says otherwise.
    fn against(self, matched: Option<[f32; 2]>) -> Refined {
        self.between(matched.unwrap_or_default(), MATCHED)
    }

    fn standing(misfit: f32) -> Refined {
        let variance = STILL * STILL * doubt(misfit);
        Refined { by: [0.0; 2], covariance: [variance, 0.0, variance], moves: false }
    }
}

/// By how much more uncertain a motion is than its returns say, for how ill it fits them: measured
/// on simulated drives, so that ellipses hold what they claim.
fn doubt(misfit: f32) -> f32 {
    let ill = misfit / DOUBTFUL;
    1.0 + ill * ill
}

/// What became of a thing.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// The motion that explains it best.
    motion: Motion,
    /// Whether it moved so, or stood.
    moves: bool,
    /// Variance of whether it did: p (1 - p) where p is how likely that is.
    unsure: f32,
    /// Misfit of standing still.
    still: f32,
    /// Largest extent along an axis, voxels.
    extent: f32,
    /// The thing it is a part of, or itself.
    whole: u32,
}

/// Its state between sweeps.
pub struct Refinement {
    clouds: [Cloud; REFINEMENT_SWEEPS_MAX],
    /// Sweeps held in `clouds`.
    held: usize,
    /// Where the newest is.
    newest: usize,
    scratch: Scratch,
    things: Things,
}

/// The things of a pair's first sweep, and what became of them.
struct Things {
    segments: Segments,
    /// Segment of each column of the first sweep's window.
    segment: [u32; COLUMNS_MAX],
    found: heapless::Vec<Found, COLUMNS_MAX>,
    /// Columns that may be part of something that moves, a bit each.
    restless: [u64; COLUMNS_MAX.div_ceil(64)],
}

/// Index of the cloud `age` sweeps before the newest.
fn index(newest: usize, age: usize) -> usize {
    (newest + REFINEMENT_SWEEPS_MAX - age) % REFINEMENT_SWEEPS_MAX
}

impl Refinement {
    pub(crate) const fn new() -> Refinement {
        Refinement {
            clouds: [const { Cloud::new() }; REFINEMENT_SWEEPS_MAX],
            held: 0,
            newest: 0,
            scratch: Scratch::new(),
            things: Things {
                segments: Segments::new(),
                segment: [0; COLUMNS_MAX],
                found: heapless::Vec::new(),
                restless: [0; COLUMNS_MAX.div_ceil(64)],
            },
        }
    }

    /// Forgets all sweeps.
    pub(crate) fn clear(&mut self) {
        self.held = 0;
    }

    /// Takes over a sweep: its returns, where and when they were, and in which column. `apart` becomes
    /// whether each is of the ground, or higher than things are. Returns how many had no room.
    pub(crate) fn take(
        &mut self,
        profile: &Profile,
        corner: [i32; 3],
        stamp_s: f64,
        points: &[Point],
        placed: &[Placed],
        columns: &[u32],
        apart: &mut [bool],
    ) -> usize {
        self.newest = (self.newest + 1) % REFINEMENT_SWEEPS_MAX;
        self.held = (self.held + 1).min(profile.refinement_sweeps as usize);
        let cloud = &mut self.clouds[self.newest];
        cloud.corner = corner;
        cloud.stamp_s = stamp_s;
        cloud.fill(profile, points, placed, columns, apart, &mut self.scratch)
    }

    /// Motion of the things of the pair's first sweep. `predicted` is the displacement that the
    /// tracklet of a column of the new window predicts, voxels.
    pub(crate) fn run(
        &mut self,
        team: &impl Team,
        step: &Step,
        perceived: &Perceived,
        predicted: impl Fn(usize) -> Option<[f32; 2]> + Sync,
    ) {
        let things = &mut self.things;
        things.found.clear();
        things.segment.fill(NONE);
        if self.held < 2 {
            return;
        }
        let Perceived { state, before, now, .. } = *perceived;
        let newest = self.newest;
        let first = &self.clouds[index(newest, 1)];
        let side = first.side;
        let shifted = |c: usize| {
            let (i, j) = ((c / side) as i32 - step.shift_x, (c % side) as i32 - step.shift_y);
            let inside = (0..step.side).contains(&i) && (0..step.side).contains(&j);
            inside.then_some((i * step.side + j) as usize)
        };
        let flow = |c: usize| shifted(c).map_or(0, |c| state[c]);
        let predicted = |c: usize| shifted(c).and_then(&predicted);
        let span = self.clouds[newest].stamp_s - first.stamp_s;
        let mut others = heapless::Vec::<Other, OTHERS>::new();
        for age in (0..self.held).filter(|a| *a != 1) {
            let cloud = &self.clouds[index(newest, age)];
            // There are fewer than the capacity.
            let _ = others.push(Other {
                nth: others.len(),
                cloud,
                offset: core::array::from_fn(|a| (first.corner[a] - cloud.corner[a]) as f32),
                scale: ((cloud.stamp_s - first.stamp_s) / span) as f32,
            });
        }
        let sweeps = Sweeps { first, others: &others, before, now, span_s: span as f32 };
        things.wholes(team, sweeps, flow, predicted);
        things.parts(team, sweeps, flow, predicted);
        things.rest(sweeps);
    }

    /// How a column of the first sweep's window moved, as part of a thing that does.
    pub(crate) fn at(&self, column: u32) -> Option<Refined> {
        let segment = *self.things.segment.get(column as usize)?;
        let found = self.things.found.get(segment as usize).filter(|f| f.moves)?;
        let side = self.clouds[index(self.newest, 1)].side as u32;
        let at = [column / side, column % side].map(|c| c as f32 + 0.5);
        Some(Refined::of(found, at))
    }

    /// How a column of the new window moved, or that it stands.
    pub(crate) fn of(&self, step: &Step, column: usize, flow: Flow) -> Refined {
        let side = step.side;
        let (i, j) = (column as i32 / side + step.shift_x, column as i32 % side + step.shift_y);
        let segment = |i: i32, j: i32| {
            let inside = (0..side).contains(&i) && (0..side).contains(&j);
            let segment = inside.then(|| self.things.segment[(i * side + j) as usize])?;
            self.things.found.get(segment as usize)
        };
        let at = [i as f32 + 0.5, j as f32 + 0.5];
        let matched = (flow & VALID != 0).then(|| flow_displacement(flow).map(|d| d as f32));
        if let Some(own) = segment(i, j) {
            let refined = Refined::of(own, at);
            return if own.moves { refined } else { refined.against(matched) };
        }
        // Nothing but low returns: the lower edge of a thing, where the match says so.
        let Some(cells) = matched else {
            return Refined::standing(0.0);
        };
        for (di, dj) in (-EDGE..=EDGE).flat_map(|a| (-EDGE..=EDGE).map(move |b| (a, b))) {
            let Some(found) = segment(i + di, j + dj).filter(|f| f.moves) else { continue };
            let refined = Refined::of(found, at);
            if (0..2).all(|a| (cells[a] - refined.by[a]).abs() <= ALIKE) {
                return refined;
            }
        }
        Refined::standing(0.0).against(matched)
    }
}

impl Things {
    /// Things as they touch: the best motion of each.
    fn wholes(
        &mut self,
        team: &impl Team,
        sweeps: Sweeps,
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<[f32; 2]> + Copy + Sync,
    ) {
        self.segments.find(sweeps.first, |_| true, flow);
        self.motions(team, sweeps, flow, predicted);
        for (n, found) in self.found.iter_mut().enumerate() {
            let columns = self.segments.columns(n);
            columns.iter().for_each(|c| self.segment[*c as usize] = n as u32);
            found.whole = n as u32;
        }
    }

    /// Appends the best motion of each segment to what was found.
    fn motions(
        &mut self,
        team: &impl Team,
        sweeps: Sweeps,
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<[f32; 2]> + Copy + Sync,
    ) {
        let before = self.found.len();
        // Parts are of what stands, and few: there is room.
        let all = (before + self.segments.len()).min(COLUMNS_MAX);
        let _ = self.found.resize(all, Found::default());
        fill(team, 0, &mut self.found[before..], &|n| {
            let thing = Thing::new(sweeps, self.segments.columns(n));
            motion(&thing, flow, predicted, &mut Visits::new())
        });
    }

    /// What stands as a whole may have a part that does not.
    fn parts(
        &mut self,
        team: &impl Team,
        sweeps: Sweeps,
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<[f32; 2]> + Copy + Sync,
    ) {
        let restless = |c: usize| {
            stands_still(&self.segment, &self.found, c)
                && flow(c) & VALID != 0
                && misfit_of(sweeps, c, |s| sweeps.standing(s)) > RESTLESS
        };
        let columns = sweeps.first.side * sweeps.first.side;
        fill(team, 0, &mut self.restless[..columns.div_ceil(64)], &|word| {
            let bits = (64 * word..columns.min(64 * (word + 1))).enumerate();
            bits.fold(0, |bits, (n, c)| bits | u64::from(restless(c)) << n)
        });
        let restless = &self.restless;
        self.segments.find(sweeps.first, |c| restless[c / 64] >> (c % 64) & 1 != 0, |_| 0);
        let wholes = self.found.len();
        self.motions(team, sweeps, flow, predicted);
        // Only those that move are kept.
        let mut kept = wholes;
        for n in wholes..self.found.len() {
            let found = self.found[n];
            if found.moves {
                let columns = self.segments.columns(n - wholes);
                let (id, whole) = (kept as u32, self.segment[columns[0] as usize]);
                columns.iter().for_each(|c| self.segment[*c as usize] = id);
                for &c in columns {
                    grow(sweeps, c as usize, &found.motion, whole, id, &mut self.segment);
                }
                self.found[kept] = Found { whole, ..found };
                kept += 1;
            }
        }
        self.found.truncate(kept);
    }

    /// What is left of such a thing, and fragments beside others that move.
    fn rest(&mut self, sweeps: Sweeps) {
        let visits = &mut Visits::new();
        self.segments.find(sweeps.first, |c| stands_still(&self.segment, &self.found, c), |_| 0);
        for n in 0..self.segments.len() {
            let columns = self.segments.columns(n);
            let near = neighbours(sweeps.first.side, columns, &self.segment, &self.found);
            if near.is_empty() {
                continue;
            }
            let thing = Thing::new(sweeps, columns);
            if thing.extent > EXTENT_MAX {
                continue;
            }
            let (still, seen) = thing.standing(visits);
            let whole = self.segment[columns[0] as usize];
            let mut best = 1.0;
            for m in &near {
                let found = self.found[*m as usize];
                let misfit = thing.misfit(&found.motion, visits);
                let rest =
                    found.whole == whole && found.extent > MOST * self.found[whole as usize].extent;
                let hidden = seen < SEEN && misfit < UNFIT;
                let joins = gain(still, misfit) > GAIN * AS_BEFORE
                    || hidden
                    || rest && misfit < still + REST;
                if joins && misfit < best {
                    best = misfit;
                    columns.iter().for_each(|c| self.segment[*c as usize] = *m);
                }
            }
        }
    }
}

/// The best motion of a thing, if any beats standing still.
fn motion(
    thing: &Thing,
    flow: impl Fn(usize) -> Flow,
    predicted: impl Fn(usize) -> Option<[f32; 2]>,
    visits: &mut Visits,
) -> Found {
    let still = Motion::around(thing.centre);
    let mut found =
        Found { still: thing.standing(visits).0, extent: thing.extent, ..Found::default() };
    let expected = mean(thing.columns.iter().filter_map(|c| predicted(*c as usize)));
    let expected = expected.filter(|by| by[0] * by[0] + by[1] * by[1] > LEAST * LEAST);
    let as_before = AS_BEFORE * (LONG / thing.extent).min(1.0);
    let ease = if expected.is_some() { as_before } else { 1.0 };
    if found.still < STANDS * ease || thing.extent > EXTENT_MAX {
        return found;
    }
    let mut best = (found.still, still);
    let mut tried = heapless::Vec::<[f32; 2], { STARTS + 3 }>::new();
    let mut start = |by: [f32; 2]| {
        if !tried.iter().any(|t| same(t, by)) {
            // There is room for every start.
            let _ = tried.push(by);
            let motion = thing.align(still.by(by), FEW, visits);
            if thing.misfit(&motion, visits) < best.0 {
                let motion = thing.align(motion, 1, visits);
                let misfit = thing.misfit(&motion, visits);
                if misfit < best.0 {
                    best = (misfit, motion);
                }
            }
        }
        best.0
    };
    let mut misfit = start([0.0; 2]);
    if let Some(by) = expected {
        misfit = start(by);
    }
    let mut votes = Votes::new(thing.columns.iter().map(|c| flow(*c as usize)));
    for _ in 0..STARTS {
        let Some(by) = votes.next().filter(|_| misfit > FITS) else { break };
        misfit = start(by);
    }
    if misfit > UNFIT && thing.samples.len() >= SEARCHED {
        start(search::search(thing));
    }
    let (misfit, motion) = best;
    let by = motion.by.xy().norm();
    // A motion that fits ill is left to the thing's parts unless it explains much.
    let gained = gain(found.still, misfit);
    let goes_on = expected.is_some_and(|e| same(&e, [motion.by.x, motion.by.y]));
    let enough = if goes_on { GAIN * as_before } else { GAIN };
    let convinces = gained > if misfit < UNFIT { enough } else { 2.0 * enough };
    found.moves = convinces && by > LEAST && thing.samples.len() >= ENOUGH;
    let likely = 1.0 / (1.0 + libm::expf((enough - gained) / SURER));
    found.unsure = likely * (1.0 - likely);
    let confidence = CONFIDENCE / (thing.range() * libm::sqrtf(thing.columns.len() as f32));
    let covariance = motion.covariance * (confidence * doubt(misfit));
    found.motion = Motion { covariance, ..motion };
    found
}

/// Whether two displacements are as good as one.
fn same(a: &[f32; 2], b: [f32; 2]) -> bool {
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < SAME
}

/// Whether a column is part of something that stands.
fn stands_still(segment: &[u32], found: &[Found], column: usize) -> bool {
    found.get(segment[column] as usize).is_some_and(|f| !f.moves)
}

/// Takes columns beside one of a moving part along if their returns fit its motion as well as
/// standing still.
fn grow(sweeps: Sweeps, column: usize, motion: &Motion, whole: u32, id: u32, segment: &mut [u32]) {
    let side = sweeps.first.side;
    let (i, j) = (column / side, column % side);
    for a in i.saturating_sub(1)..(i + 2).min(side) {
        for b in j.saturating_sub(1)..(j + 2).min(side) {
            let beside = a * side + b;
            if segment[beside] == whole {
                let moved = misfit_of(sweeps, beside, |s| Some(sweeps.moving(s, motion)));
                if moved < misfit_of(sweeps, beside, |s| sweeps.standing(s)) + AS_WELL {
                    segment[beside] = id;
                }
            }
        }
    }
}

/// Mean misfit of some returns of a column, 0 where it cannot be told.
fn misfit_of(sweeps: Sweeps, column: usize, misfit: impl Fn(&Sample) -> Option<f32>) -> f32 {
    let returns = sweeps.first.column(column);
    let stride = returns.len().div_ceil(PROBES).max(1);
    let mut mean = Mean::default();
    let samples = returns.step_by(stride).map(|n| sweeps.first.sample(n));
    samples.filter_map(|s| misfit(&s)).for_each(|m| mean.add(m));
    mean.value()
}

fn mean(of: impl Iterator<Item = [f32; 2]>) -> Option<[f32; 2]> {
    let (mut n, mut sum) = (0.0, [0.0; 2]);
    for v in of {
        n += 1.0;
        sum = [sum[0] + v[0], sum[1] + v[1]];
    }
    (n > 0.0).then(|| sum.map(|s| s / n))
}

/// Displacements of matched columns, counted.
struct Votes([[u16; SIDE]; SIDE]);

impl Votes {
    fn new(flows: impl Iterator<Item = Flow>) -> Votes {
        let mut votes = [[0u16; SIDE]; SIDE];
        for flow in flows.filter(|f| f & VALID != 0) {
            let [u, v] = flow_displacement(flow).map(|d| (d + REACH) as usize);
            votes[u][v] = votes[u][v].saturating_add(1);
        }
        Votes(votes)
    }

    /// The mean of the most frequent displacement and its neighbours, which are counted no more.
    fn next(&mut self) -> Option<[f32; 2]> {
        let mut top = (0, 0, 0);
        for (u, line) in self.0.iter().enumerate() {
            for (v, &count) in line.iter().enumerate() {
                if count > top.0 {
                    top = (count, u, v);
                }
            }
        }
        let (_, u, v) = (top.0 > 0).then_some(top)?;
        let (mut sum, mut at) = (0.0, [0.0; 2]);
        for a in u.saturating_sub(1)..(u + 2).min(SIDE) {
            for b in v.saturating_sub(1)..(v + 2).min(SIDE) {
                let count = core::mem::take(&mut self.0[a][b]) as f32;
                sum += count;
                at[0] += count * (a as i32 - REACH) as f32;
                at[1] += count * (b as i32 - REACH) as f32;
            }
        }
        Some(at.map(|v| v / sum))
    }
}

/// Moving things near a fragment.
fn neighbours(
    side: usize,
    columns: &[u32],
    segment: &[u32],
    found: &[Found],
) -> heapless::Vec<u32, NEIGHBOURS> {
    let mut near = heapless::Vec::new();
    for &c in columns {
        let (i, j) = (c as usize / side, c as usize % side);
        for a in i.saturating_sub(NEAR)..(i + NEAR + 1).min(side) {
            for b in j.saturating_sub(NEAR)..(j + NEAR + 1).min(side) {
                let other = segment[a * side + b];
                let moves = found.get(other as usize).is_some_and(|f| f.moves);
                if moves && !near.contains(&other) {
                    // Beyond the capacity: the first ones are enough.
                    let _ = near.push(other);
                }
            }
        }
    }
    near
}
