//! Rays: returns in the grid's frame (B.2.2), with time and motion taken into account.
//!
//! A return is moved by the vehicle's pose at its own time slot (motion compensation, "deskewing")
//! and quantised relative to the window's central voxel.

mod batch;

use crate::dropped::DroppedReturns;
use crate::frame::{Window, central};
use crate::params::{ORIGINS_MAX, Profile, SENSORS_MAX, SLOTS};
use crate::pose::Pose;
use crate::record::{NONE, Ray, SweepUniform, ray};
use crate::refinement::forest::MovesForest;
use crate::return_clock::ReturnClock;
use crate::stages::occupancy_constancy::Scores;
use crate::sweep::{Placed, Point, Rig, Sweep, Timing};
use crate::team::{self, Team};
use crate::thinning::TakenPoints;
use batch::{RayLattice, ReturnBatch};
use core::array::from_fn;
use glam::DVec3;
use raywake_simd::Simd;

fn add(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Everything that stays the same from sweep to sweep.
pub struct Setup {
    /// Must pass [`Profile::check`].
    pub profile: Profile,
    /// Where the sensors are mounted.
    pub rig: Rig,
    /// Range of the constancy classifier's scores.
    pub scores: Scores,
    /// Turns cues into P(moves).
    pub moves: MovesForest,
    /// Whether every solid column is foreground.
    pub unfiltered: bool,
    /// Turns sweeps into rays.
    pub preparation: Preparation,
}

/// The uniform for tracing `rays` rays through a profile's window.
pub fn uniform_of(profile: &Profile, rays: usize) -> SweepUniform {
    SweepUniform {
        side: profile.side as i32,
        levels: profile.levels as i32,
        rays: rays as i32,
        range_steps: profile.range_steps(),
        ..SweepUniform::default()
    }
}

/// Parts of a sweep that threads share; the returns of all but the last take an extra pass.
const PARTS: usize = 4;

/// Turns sweeps into rays.
pub struct Preparation {
    clock: ReturnClock,
}

/// A 3x4 matrix to voxel coordinates, with half a voxel added so that rounding down finds the
/// voxel.
type ToVoxel = [[f32; 4]; 3];

impl Default for Preparation {
    fn default() -> Self {
        Preparation::new()
    }
}

impl Preparation {
    /// Builds the tables.
    pub fn new() -> Preparation {
        Preparation { clock: ReturnClock::new() }
    }

    /// Casts the rays of a sweep, the same for any size of the team; returns their number, and what
    /// was left out.
    pub fn prepare(
        &self,
        team: &impl Team,
        placement: &Placement,
        out: RayBuffers,
    ) -> (usize, DroppedReturns) {
        let RayBuffers { rays, origins, columns, placed } = out;
        let Placement { profile, rig, sweep, .. } = *placement;
        let points = TakenPoints::new(sweep.points, profile.returns());
        let count = points.count();
        assert!(rays.len() >= count && columns.len() >= count);
        let caster = Caster::new(&self.clock, team.simd(), placement, origins);
        let part = |n: usize| count * n / PARTS..count * (n + 1) / PARTS;
        // The rays of each part start behind the room for those of the parts before it.
        let is_ray = |p: &&Point| DroppedReturns::default().admit(rig, p).is_some();
        let mut admitted = [0; PARTS];
        team::fill(team, 0, &mut admitted[..PARTS - 1], &|n| {
            points.range(part(n)).filter(is_ray).count()
        });
        let (mut rays_left, mut columns, mut placed) = (&mut *rays, columns, placed);
        let mut parts: heapless::Vec<_, PARTS> = (0..PARTS)
            .map(|n| {
                let len = part(n).len();
                let of_part = if n + 1 < PARTS { admitted[n] } else { rays_left.len() };
                let rays = rays_left.split_off_mut(..of_part).expect("room");
                let columns = columns.split_off_mut(..len).expect("as many");
                let placed = placed.split_off_mut(..len.min(placed.len())).expect("no more");
                CastReturns::new(rays, columns, placed)
            })
            .collect();
        team::each(team, 0, &mut parts, &|n, castings| {
            caster.cast_all(points.range(part(n)), castings);
        });
        let found: [_; PARTS] = from_fn(|n| (parts[n].count, parts[n].dropped));
        drop(parts);
        let over_capacity = points.left_out() as u64;
        let mut dropped = DroppedReturns { over_capacity, ..DroppedReturns::default() };
        let (mut end, mut from) = (0, 0);
        for ((count, of_part), room) in found.into_iter().zip(admitted) {
            dropped += of_part;
            if end < from {
                // Rare: `rays` may be device memory that is slow to read.
                rays.copy_within(from..from + count, end);
            }
            (end, from) = (end + count, from + room);
        }
        let all = end + dropped.without_ray() as usize;
        assert_eq!(all, sweep.points.len(), "returns that are cast or left out");
        (end, dropped)
    }
}

/// A sweep, where it was taken and where the window lies.
#[derive(Clone, Copy)]
pub struct Placement<'a> {
    /// Sizes and deskewing.
    pub profile: &'a Profile,
    /// Where the sensors are mounted, and when a return was measured.
    pub rig: &'a Rig,
    /// Where the window lies.
    pub window: &'a Window,
    /// The sweep.
    pub sweep: &'a Sweep<'a>,
}

impl Placement<'_> {
    /// Whether returns are moved to the stamp according to their time.
    fn deskews(&self) -> bool {
        self.profile.deskew && self.rig.distorted
    }

    /// Whether the vehicle's motion within the sweep counts.
    pub(crate) fn is_moving(&self) -> bool {
        self.rig.timing != Timing::AtStamp && (self.deskews() || !self.rig.distorted)
    }

    /// Position of a sensor with this mounting at an offset from the stamp, s: voxels from the
    /// centre of the central voxel.
    pub(crate) fn sensor(&self, mounted: &Pose, offset_s: f64) -> DVec3 {
        let moved = if self.is_moving() { self.sweep.twist.over(offset_s) } else { Pose::IDENTITY };
        (self.window.grid_from_vehicle * moved * *mounted).translation / self.profile.voxel_m
    }
}

/// Caller-owned storage for the rays of a sweep.
pub struct RayBuffers<'a> {
    /// One element per return taken, possibly in device memory that is slow to read.
    pub rays: &'a mut [Ray],
    /// [`ORIGINS_MAX`] elements; the voxels of the ray origins.
    pub origins: &'a mut [[i32; 4]],
    /// One element per return taken; the column it lies in, or [`NONE`].
    pub columns: &'a mut [u32],
    /// Where and when each return was measured, as far as there is room.
    pub placed: &'a mut [Placed],
}

/// Casts the rays of one sweep.
struct Caster<'a> {
    clock: &'a ReturnClock,
    rig: &'a Rig,
    simd: Simd,
    lattice: RayLattice,
    /// Whether the vehicle's motion within the sweep counts.
    moving: bool,
    origin_ids: OriginIds,
    /// Start of the sweep relative to the stamp, and length of a slot, s.
    from_s: f32,
    slot_s: f32,
}

impl<'a> Caster<'a> {
    fn new(
        clock: &'a ReturnClock,
        simd: Simd,
        placement: &Placement<'a>,
        origins: &mut [[i32; 4]],
    ) -> Caster<'a> {
        let Placement { profile, rig, window, sweep } = *placement;
        let (deskew, moving) = (placement.deskews(), placement.is_moving());
        let moved = |slot| if deskew && moving { sweep.motion(rig, slot) } else { Pose::IDENTITY };
        let matrix = |slot| voxel_matrix(profile, &(window.grid_from_vehicle * moved(slot)));
        let [from_s, to_s] = [0.0, SLOTS as f64].map(|when| rig.timing.offset_s(when) as f32);
        let slot_s = (to_s - from_s) / SLOTS as f32;
        Caster {
            clock,
            rig,
            simd,
            lattice: RayLattice {
                side: profile.side,
                levels: profile.levels,
                centre: central(profile),
                to_voxel: from_fn(matrix),
                drift: Drift::new(profile, window, sweep, if deskew { slot_s } else { 0.0 }),
            },
            moving,
            origin_ids: place_origins(placement, origins),
            from_s,
            slot_s,
        }
    }

    /// Casts the rays of some returns, and stores their columns and positions.
    fn cast_all<'p>(&self, points: impl Iterator<Item = &'p Point>, out: &mut CastReturns) {
        let count = out.columns.len();
        self.simd.run(
            #[inline(always)]
            |_| {
                let mut batch = ReturnBatch::new();
                for (n, point) in points.take(count).enumerate() {
                    match out.dropped.admit(self.rig, point) {
                        None => out.leave_out(n),
                        Some(own) if batch.push(n, point, own) => self.cast(&mut batch, out),
                        Some(_) => {}
                    }
                }
                self.cast(&mut batch, out);
            },
        );
    }

    /// Casts the rays of a batch and empties it.
    #[inline(always)]
    fn cast(&self, batch: &mut ReturnBatch, out: &mut CastReturns) {
        let found = self.place(batch);
        for l in 0..core::mem::take(&mut batch.len) {
            let (n, own) = (batch.index[l], batch.own[l]);
            if found.far[l] {
                out.dropped.too_far += 1;
                out.leave_out(n);
                continue;
            }
            out.dropped.own_vehicle += u64::from(own);
            let end = [found.end[0][l], found.end[1][l], found.end[2][l]];
            let origin = self.origin_ids[batch.sensor[l]][found.slot[l] as usize];
            out.rays[out.count] = ray(end, origin, own);
            out.count += 1;
            if own {
                out.leave_out(n);
                continue;
            }
            out.columns[n] = found.column[l];
            if let Some(placed) = out.placed.get_mut(n) {
                let at = [found.at[0][l], found.at[1][l], found.at[2][l]];
                *placed = Placed { at, offset_s: self.from_s + found.when[l] * self.slot_s };
            }
        }
    }
}

/// The result of casting some returns.
struct CastReturns<'a> {
    rays: &'a mut [Ray],
    /// Number of rays so far.
    count: usize,
    columns: &'a mut [u32],
    placed: &'a mut [Placed],
    dropped: DroppedReturns,
}

impl<'a> CastReturns<'a> {
    fn new(
        rays: &'a mut [Ray],
        columns: &'a mut [u32],
        placed: &'a mut [Placed],
    ) -> CastReturns<'a> {
        CastReturns { rays, count: 0, columns, placed, dropped: DroppedReturns::ZERO }
    }

    /// Marks a return as one that ends nowhere.
    fn leave_out(&mut self, n: usize) {
        self.columns[n] = NONE;
        if let Some(placed) = self.placed.get_mut(n) {
            *placed = Placed::LEFT_OUT;
        }
    }
}

/// The effect of the vehicle's motion within a slot on its returns: translation and yaw.
struct Drift {
    /// Voxels and radians per slot.
    by: [f32; 3],
    turn: f32,
    /// Where the vehicle is, voxels from the window's corner.
    centre: [f32; 2],
}

impl Drift {
    fn new(profile: &Profile, window: &Window, sweep: &Sweep, slot_s: f32) -> Drift {
        let from_vehicle = window.grid_from_vehicle;
        let by = from_vehicle.rotation * sweep.twist.linear * (f64::from(slot_s) / profile.voxel_m);
        let at = from_vehicle.translation / profile.voxel_m;
        let middle = central(profile);
        Drift {
            by: by.to_array().map(|v| v as f32),
            turn: sweep.twist.angular.z as f32 * slot_s,
            centre: [at.x, at.y].map(|v| v as f32 + 0.5 + middle[0] as f32),
        }
    }

    /// The position `after` slots later.
    #[inline(always)]
    fn place(&self, [x, y, z]: [f32; 3], after: f32) -> [f32; 3] {
        let ([dx, dy, dz], [cx, cy]) = (self.by, self.centre);
        [
            x + after * (dx - self.turn * (y - cy)),
            y + after * (dy + self.turn * (x - cx)),
            z + after * dz,
        ]
    }
}

fn voxel_matrix(profile: &Profile, grid_from_point: &Pose) -> ToVoxel {
    let inverse = 1.0 / profile.voxel_m;
    let m = grid_from_point.matrix();
    let t = grid_from_point.translation * inverse;
    [0, 1, 2].map(|a| {
        let r = m.row(a) * inverse;
        [r.x as f32, r.y as f32, r.z as f32, (t[a] + 0.5) as f32]
    })
}

/// Beyond any window, voxels: coordinates saturate here.
const FAR: f32 = 1e6;

/// The integer nearest to a coordinate, voxels.
fn nearest(coordinate: f64) -> i32 {
    libm::floor(coordinate + 0.5).clamp(-f64::from(FAR), f64::from(FAR)) as i32
}

/// Index of the origin of every sensor in every slot.
type OriginIds = [[u32; SLOTS]; SENSORS_MAX];

/// Writes the voxels of the ray origins; returns which of them each sensor and slot has. Slots
/// whose origins share a voxel share an entry, so that equal rays can be recognised.
fn place_origins(placement: &Placement, origins: &mut [[i32; 4]]) -> OriginIds {
    assert!(origins.len() == ORIGINS_MAX);
    let Placement { profile, rig, .. } = *placement;
    let mut ids = [[0; SLOTS]; SENSORS_MAX];
    // Searched here, not in `origins`, which may be device memory that is slow to read.
    let mut table = heapless::Vec::<[i32; 4], ORIGINS_MAX>::new();
    let slots = if placement.is_moving() { SLOTS } else { 1 };
    for (sensor, mounted) in rig.sensors.iter().enumerate() {
        for (slot, id) in ids[sensor][..slots].iter_mut().enumerate() {
            let at = placement.sensor(mounted, rig.timing.offset_s(slot as f64 + 0.5));
            let v = at.to_array().map(nearest);
            let [x, y, z] = add(v, central(profile));
            let known = table.iter().position(|o| *o == [x, y, z, 0]);
            *id = known.unwrap_or(table.len()) as u32;
            if known.is_none() {
                // There is room for all.
                let _ = table.push([x, y, z, 0]);
            }
        }
    }
    origins[..table.len()].copy_from_slice(&table);
    ids
}

#[cfg(test)]
mod tests;
