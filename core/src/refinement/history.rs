//! Where something was hit in earlier sweeps: a moving object comes to where nothing stood.
//!
//! Registration considers only a few sweeps. A static object may look so different from one sweep
//! to the next that a motion explains it better; but its places were hit long before the motion
//! would have brought it there. A car that has just pulled out was at its places before, too: such
//! hits do not count.

use super::cloud::{Cloud, DetailedCloud};
use super::cues::{Looks, PREDICTING_AGE};
use crate::params::{CLUSTER_LEVELS_MAX, COLUMNS_MAX};

/// Number of sweeps before the pair's first that are remembered: 0.6 s at 10 Hz. The vehicle ahead
/// was where one is now a second ago, if it keeps its distance.
const HISTORY: usize = 6;

const _: () = assert!(CLUSTER_LEVELS_MAX == u32::BITS as usize);

/// One earlier sweep.
struct PastSweep {
    /// Lattice index of the window's first voxel.
    corner: [i32; 3],
    stamp_s: f64,
    levels: [u32; COLUMNS_MAX],
}

/// The sweeps before the pair's first.
pub struct History {
    sweeps: [PastSweep; HISTORY],
    /// Sweeps remembered.
    held: usize,
    /// Where the next one goes.
    next: usize,
}

impl History {
    pub const fn new() -> History {
        History {
            sweeps: [const { PastSweep { corner: [0; 3], stamp_s: 0.0, levels: [0; COLUMNS_MAX] } };
                HISTORY],
            held: 0,
            next: 0,
        }
    }

    pub fn clear(&mut self) {
        (self.held, self.next) = (0, 0);
    }

    /// Whether there were too few sweeps before the pair's first for tracklets to predict anything.
    pub fn is_short(&self) -> bool {
        // As many pairs came before this one; after the first of them, tracklets have age 0.
        self.held <= PREDICTING_AGE as usize
    }

    /// Remembers a sweep in place of the oldest, without the columns of what was seen to come from
    /// elsewhere: a vehicle that follows another comes to where that one was.
    pub fn push(&mut self, cloud: DetailedCloud, came: impl Fn(usize) -> bool) {
        let columns = cloud.side * cloud.side;
        let past = &mut self.sweeps[self.next];
        (past.corner, past.stamp_s) = (cloud.corner, cloud.stamp_s);
        let levels = |c| if came(c) { 0 } else { cloud.levels(c) };
        past.levels[..columns].iter_mut().enumerate().for_each(|(c, past)| *past = levels(c));
        self.next = (self.next + 1) % HISTORY;
        self.held = (self.held + 1).min(HISTORY);
    }

    /// Whether a column of the pair's first sweep holds something new: nothing was hit there in any
    /// sweep at least `since_s` older, there is such a sweep, and each of them covers the column.
    pub fn is_new(&self, first: DetailedCloud, column: usize, since_s: f64) -> bool {
        let levels = first.levels(column);
        let at = [column / first.side, column % first.side];
        let old = |past: &&PastSweep| first.stamp_s - past.stamp_s >= since_s;
        let mut old = self.sweeps[..self.held].iter().filter(old).peekable();
        let unseen =
            |past: &PastSweep| past.around(&first, at).is_some_and(|earlier| levels & earlier == 0);
        levels != 0 && old.peek().is_some() && old.all(unseen)
    }

    /// The looks at the voxels of a column of the pair's first sweep, supposing that it moves by
    /// `by` voxels over the pair, which spans `span_s`. `is_part` tells whether another column
    /// belongs to the same cluster. It may have been at rest and sped up by `acceleration`, voxels
    /// per span²; `None` if it cannot have started.
    pub fn looks(
        &self,
        first: DetailedCloud,
        column: usize,
        by: [f32; 2],
        span_s: f64,
        acceleration: Option<f32>,
        is_part: impl Fn(usize) -> bool,
    ) -> Looks {
        let (mut looks, levels) = (Looks::default(), first.levels(column));
        if levels == 0 {
            return looks;
        }
        let at = [column / first.side, column % first.side];
        // If what was here then is part of the cluster, it is now that much farther on.
        let is_part = |[x, y]: [f32; 2]| {
            let on = [at[0] as f32 + 0.5 + x, at[1] as f32 + 0.5 + y];
            first.column_at(on).is_some_and(&is_part)
        };
        // Beyond the window.
        let reach = 2.0 * first.side as f32;
        for past in &self.sweeps[..self.held] {
            let spans = ((first.stamp_s - past.stamp_s) / span_s) as f32;
            if is_part(by.map(|b| spans * b)) {
                continue;
            }
            let Some(were) = past.around(&first, at) else { continue };
            let hits = (levels & were).count_ones();
            looks.made += levels.count_ones();
            looks.empty += (levels & !were).count_ones();
            // What started since came less far: the hits may have been of itself.
            let own = |acceleration| since_rest(by, acceleration, spans, reach).any(is_part);
            if hits > 0 && !acceleration.is_some_and(own) {
                looks.hits += hits;
            }
        }
        looks
    }
}

/// How far something that moves by `by` voxels per span may have come since it was at rest, at most
/// `spans` ago, if it sped up by at most `acceleration` voxels per span²: in steps of at most one
/// voxel. Distances above `reach` voxels are cut to that. Nothing if it cannot have been at rest.
fn since_rest(
    by: [f32; 2],
    acceleration: f32,
    spans: f32,
    reach: f32,
) -> impl Iterator<Item = [f32; 2]> {
    let speed = libm::hypotf(by[0], by[1]).max(f32::MIN_POSITIVE);
    let was_at_rest = speed <= acceleration * spans;
    // It sped up just now, or at once.
    let least = 0.5 * speed * (speed / acceleration);
    let most = speed * spans - least;
    let [least, most] = [least, most].map(|length| length.min(reach));
    let steps = libm::ceilf(most - least).max(0.0);
    (0..=steps as u32).filter(move |_| was_at_rest).map(move |n| {
        let length = least + (most - least) * (n as f32 / steps.max(1.0));
        by.map(|b| b / speed * length)
    })
}

impl PastSweep {
    /// Levels hit in a column of a later sweep's window, widened by a level up and down because the
    /// ground is estimated anew in every sweep; `None` if the column lay outside.
    fn around(&self, later: &Cloud, at: [usize; 2]) -> Option<u32> {
        let here = |a: usize| at[a] as i32 + later.corner[a] - self.corner[a];
        let [i, j] = [here(0), here(1)];
        let inside = (0..later.side as i32).contains(&i) && (0..later.side as i32).contains(&j);
        let levels = inside.then(|| self.levels[i as usize * later.side + j as usize])?;
        Some(levels | levels << 1 | levels >> 1)
    }
}
