//! The columns of one sweep, computed by the core's own stages.

use glam::DVec3;
use raywake_core::frame::{Window, central, place};
use raywake_core::params::Profile;
use raywake_core::prepare::{Placement, Preparation, RayBuffers, uniform_of};
use raywake_core::record::{Column, NONE, SweepUniform};
use raywake_core::stages::{GRID, StageProgram, Storage, run};
use raywake_core::sweep::{Rig, Sweep};
use raywake_core::team::SingleThread;
use raywake_core::thinning::Thinning;

/// Everything that a grid runs, and hence everything that its storage holds.
const GRID_ALONE: &[StageProgram] = &[StageProgram { name: "grid", ops: GRID }];

/// Working state and results of [`Grid::sweep`].
pub struct Grid {
    profile: Profile,
    preparation: Preparation,
    lattice_origin: Option<DVec3>,
    offset: DVec3,
    words: Vec<u32>,
    /// Sizes of the window.
    pub step: SweepUniform,
    /// Columns of the window.
    pub columns: Vec<Column>,
    /// Column of every point taken.
    of_taken: Vec<u32>,
    /// Column of every point of the sweep; [`NONE`] if it has none or was not taken.
    pub of_point: Vec<u32>,
}

impl Grid {
    /// A grid at the start of a drive.
    pub fn new(profile: Profile) -> Grid {
        Grid {
            preparation: Preparation::new(),
            lattice_origin: None,
            offset: DVec3::ZERO,
            words: vec![0; Storage::words(GRID_ALONE, &profile)],
            step: uniform_of(&profile, 0),
            columns: vec![[0; 2]; profile.columns()],
            of_taken: vec![0; profile.returns()],
            of_point: Vec::new(),
            profile,
        }
    }

    /// A grid on the lattice of a window: that of the drive's first sweep.
    pub fn on_lattice(profile: Profile, window: Window) -> Grid {
        Grid { lattice_origin: Some(window.lattice_origin), ..Grid::new(profile) }
    }

    /// Starts another drive. Its lattice lies `offset` (m, along the world's axes) from where a run
    /// would place it: after some time on the road any offset within half a cell is equally likely.
    pub fn restart(&mut self, offset: DVec3) {
        self.lattice_origin = None;
        self.offset = offset;
    }

    /// Fills `columns` and `of_point` from a sweep; returns the window's placement.
    pub fn sweep(&mut self, rig: &Rig, sweep: &Sweep) -> Window {
        // As the pipeline does.
        let sweep = &Sweep { twist: sweep.twist.to_grain(), ..*sweep };
        let pose = &sweep.world_from_vehicle;
        let origin = self
            .lattice_origin
            .unwrap_or_else(|| place(&self.profile, rig, pose, None).lattice_origin + self.offset);
        self.lattice_origin = Some(origin);
        let window = place(&self.profile, rig, pose, Some(origin));
        let mut storage = Storage::over(&mut self.words, GRID_ALONE, &self.profile);
        let (count, _) = self.preparation.prepare(
            &SingleThread,
            &Placement { profile: &self.profile, rig, window: &window, sweep },
            RayBuffers {
                rays: storage.rays,
                origins: storage.origins,
                columns: &mut self.of_taken,
                placed: &mut [],
            },
        );
        self.step.rays = count as i32;
        let of_taken = &self.of_taken;
        let thinning = Thinning::new(sweep.points.len(), self.profile.returns());
        let column = |index| thinning.rank(index).map_or(NONE, |n| of_taken[n]);
        self.of_point.clear();
        self.of_point.extend((0..thinning.of()).map(column));
        storage.sweep = self.step;
        run(GRID, &mut storage, 0, &SingleThread, &mut |_| ());
        self.columns.copy_from_slice(storage.columns_now);
        window
    }

    /// Log-odds of every voxel of the last sweep, tenths.
    pub fn log_odds(&mut self) -> &[i32] {
        Storage::over(&mut self.words, GRID_ALONE, &self.profile).log_odds
    }

    /// Indices of the solid columns.
    pub fn solid(&self) -> impl Iterator<Item = usize> + use<'_> {
        self.columns.iter().enumerate().filter(|(_, c)| c[1] != 0).map(|(n, _)| n)
    }

    /// Edge of a voxel, m.
    pub fn voxel_m(&self) -> f64 {
        self.profile.voxel_m
    }

    /// Radius of the circle around the window, m.
    pub fn reach_m(&self) -> f64 {
        0.5 * 2f64.sqrt() * self.profile.side as f64 * self.profile.voxel_m
    }

    /// Centre of a column in the vehicle frame, m; its height is that of the anchor.
    pub fn centre(&self, window: &Window, column: usize) -> DVec3 {
        let (i, j) = (column as i32 / self.step.side, column as i32 % self.step.side);
        let [ci, cj, _] = central(&self.profile);
        let cell = DVec3::new((i - ci) as f64, (j - cj) as f64, 0.0);
        window.grid_from_vehicle.inverse().transform(cell * self.profile.voxel_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::pose::{Pose, Twist};
    use raywake_core::sweep::{Point, Timing};

    fn rig() -> Rig {
        Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing: Timing::AtStamp,
            distorted: false,
            ground_m: -1.73,
            own_vehicle: None,
        }
    }

    #[test]
    fn a_point_lies_in_the_column_around_it() {
        let rig = rig();
        let mut grid = Grid::new(Profile::hdl64());
        for world_from_vehicle in [Pose::IDENTITY, Pose::planar(7.1, -3.4, 0.2, 0.6)] {
            let points = [Point { position: [11.3, -4.2, -0.5], ..Point::default() }];
            let twist = Twist::ZERO;
            let sweep = Sweep { stamp_s: 0.0, points: &points, world_from_vehicle, twist };
            let window = grid.sweep(&rig, &sweep);
            let column = grid.of_point[0] as usize;
            assert!(grid.solid().eq([column]));
            let off = grid.centre(&window, column) - DVec3::new(11.3, -4.2, 0.0);
            assert!(off.x.hypot(off.y) <= 0.3 * 0.5f64.sqrt() + 1e-6);
        }
    }

    #[test]
    fn drives_may_start_anywhere_on_the_lattice() {
        let rig = rig();
        let mut grid = Grid::new(Profile::hdl64());
        let points = [Point { position: [11.3, -4.2, -0.5], ..Point::default() }];
        let at = |x: f64| Sweep {
            stamp_s: 0.0,
            points: &points,
            world_from_vehicle: Pose::planar(x, 0.0, 0.0, 0.0),
            twist: Twist::ZERO,
        };
        for offset in [DVec3::ZERO, DVec3::new(0.1, -0.05, 0.12)] {
            grid.restart(offset);
            let first = grid.sweep(&rig, &at(3.0));
            assert!((first.lattice_origin - DVec3::new(3.0, 0.0, 0.0) - offset).length() < 1e-9);
            // It stays there.
            assert_eq!(grid.sweep(&rig, &at(5.0)).lattice_origin, first.lattice_origin);
        }
    }
}
