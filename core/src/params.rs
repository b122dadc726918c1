//! Every number a human chooses: ceilings that size storage, then the tunables of a run.

use crate::continuity::Limits;
use heapless::String;

/// Returns of one sweep; further ones, in the source's order, are dropped and counted.
/// (The dissertation's n_max is 150,000; no labelled KITTI sweep has more than 124,123.)
pub const POINTS_MAX: usize = 131_072;
/// Levels of a column: free and occupied masks share one 32-bit word.
pub const LEVELS_MAX: usize = 16;
/// Columns of the flow window: 256 x 256 cells, 76.8 m at 0.30 m.
pub const COLUMNS_MAX: usize = 65_536;
/// Foreground columns of one sweep; further ones, in column order, are dropped and counted.
/// The busiest sweep seen has 8,795 solid columns in a 50 m window.
pub const FOREGROUND_MAX: usize = 12_288;
/// Time slots a sweep is divided into for ray origins and motion correction: 1.6 ms at 10 Hz.
pub const SLOTS: usize = 64;
/// Distinct ray origins of a sweep: every sensor in every slot.
pub const ORIGINS_MAX: usize = crate::sweep::SENSORS_MAX * SLOTS;
/// Half width of the search, cells (n_s = 31, section 3.8.1): 45 m/s at 0.30 m and 10 Hz.
pub const REACH: i32 = 15;
/// Width of the search, cells.
pub const SIDE: usize = 2 * REACH as usize + 1;
/// Elements from one line of the search to the next: [`SIDE`] and one of padding, so that an index
/// is two shifts away from its displacement.
pub const LINE: usize = 32;
/// Elements of a row of costs, one row per foreground column: displacement `(du, dv)` is element
/// `(du + REACH) * LINE + dv + REACH`, the order in which ties are broken.
pub const ROW: usize = SIDE * LINE;
/// Words of a row: two 16-bit costs a word.
pub const ROW_WORDS: usize = ROW / 2;
/// Slots of the table that merges equal rays: twice the points, so that it is at most half full.
pub const MERGE_SLOTS: usize = 2 * POINTS_MAX;
/// Probes of that table before a ray is traced alone.
pub const MERGE_PROBES: u32 = 64;
/// Voxels a return may lie from the window's corner along an axis; farther ones are dropped.
pub const EXTENT_VOXELS: i32 = 4095;
/// Sweeps the refinement of the flow may look at.
pub const REFINEMENT_SWEEPS_MAX: usize = 4;
/// Thinned returns of one sweep that the refinement keeps; those of the last columns are dropped
/// and counted.
pub const CLOUD_MAX: usize = 65_536;
/// Updates (voxel, log-odds) of one band of the sparse map.
pub const BAND_UPDATES: usize = 1 << 20;
/// Threads of a workgroup of every one-dimensional kernel.
pub const WORKGROUP: usize = 256;
/// Threads of a workgroup where each handles a ray or a foreground column, or all of them one column.
pub const ROW_WORKGROUP: usize = 64;
/// Items a workgroup of the prefix sum and of the radix sort handles.
pub const TILE: usize = 1024;
/// Digit values of one radix pass (4 bits).
pub const RADIX: usize = 16;

/// Log-odds of a voxel a ray passes, tenths (Table B.1: -0.1).
pub const LOG_ODDS_FREE: i32 = -1;
/// Log-odds of a voxel a ray ends in, tenths (Table B.1: 1.0).
pub const LOG_ODDS_OCCUPIED: i32 = 10;
/// From these tenths on a voxel is solid: p > 0.6, the author's test for a column worth matching.
pub const LOG_ODDS_SOLID: i32 = 5;
/// Bounds of log-odds where probabilities are put out, tenths (Table B.1).
pub const LOG_ODDS_CLIP: [i32; 2] = [-30, 30];
/// `-log 0.5` in thousandths of a nat: the cost of a window neighbour that says nothing.
pub const COST_UNKNOWN: u32 = 693;
/// Height of the HDL-64E above ground on KITTI's car, m: levels are anchored to it, so that the
/// learned weights of a level meet the same height on any vehicle.
pub const ANCHOR_ABOVE_GROUND_M: f64 = 1.73;

const _: () = assert!(SIDE < LINE && LINE.is_power_of_two() && ROW_WORDS.is_multiple_of(4));
const _: () = assert!(MERGE_SLOTS.is_power_of_two());
const _: () = assert!(BAND_UPDATES <= TILE * TILE);
const _: () = assert!(COLUMNS_MAX <= TILE * TILE);

/// The frame the grid lies in (B.2.2 leaves it open).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Axes and cell borders fixed in the world; the window follows the vehicle by whole cells.
    Lattice,
    /// The vehicle frame of each sweep, as in the dissertation.
    Sensor,
}

/// Where a tracklet is born.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Birth {
    /// At the target cell, the vehicle's present.
    Target,
    /// At the source cell: one step behind its first prediction, as the author's program does.
    Source,
}

/// The tracklet filter's numbers (section 3.6.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackletParams {
    /// Standard deviation of a measured position, cells: half a cell.
    pub measurement_cells: f32,
    /// Standard deviation of what the poses err from one sweep to the next, m: a guess, which
    /// `innovation_sweeps` corrects. Tracklets allow for it beside the covariance of a
    /// displacement, which is by the poses given.
    pub pose_noise_m: f32,
    /// Process noise of the speed, m/s per second, as a standard deviation per step of `dt`.
    pub speed_noise_mps2: f32,
    /// Process noise of the turning rate, rad/s per second.
    pub turn_noise_radps2: f32,
    /// Standard deviation of the turning rate at birth, rad/s.
    pub turn_birth_radps: f32,
    /// Limit of the squared Mahalanobis distance (3.25); 9.2103 is the 99 % quantile of
    /// chi-square with two degrees of freedom.
    pub gate_d2: f32,
    /// Sweeps over which the innovations of a tracklet tell how large all its noise is (the
    /// exponential mean, from 1 on); 0: as large as assumed.
    pub innovation_sweeps: f32,
    /// Where a tracklet is born.
    pub birth: Birth,
    /// Whether a tracklet whose cell was not observed takes over an observed column beside it.
    pub takes_over: bool,
    /// Sweeps a tracklet lives on without an observation (5.2.2).
    pub coast_sweeps: u32,
}

/// Everything that distinguishes one run of the flow pipeline from another.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name shown in reports.
    pub name: String<24>,
    /// Columns of the square window along one axis; odd, so that one is the centre.
    pub side: u32,
    /// Levels of a column.
    pub levels: u32,
    /// Edge of a voxel, m (Table B.1: r).
    pub voxel_m: f64,
    /// Greatest range of a return, m (Table B.1: m_r), counted in voxels along the ray's longest
    /// axis as the update list of B.2.1 does.
    pub range_m: f64,
    /// Frame of the grid.
    pub frame: Frame,
    /// Whether returns of a distorted source are moved to the stamp.
    pub deskew: bool,
    /// Rounds of expectation and maximisation (n_em).
    pub em_rounds: u32,
    /// Weight of the smoothing term w_p, thousandths of a nat per cell².
    pub smoothing: u32,
    /// Cost of displacement, thousandths of a nat per cell² (the author's program: 0.001).
    pub displacement_cost: u32,
    /// Cost of a window neighbour outside the grid, thousandths of a nat.
    pub outside_cost: u32,
    /// Sweeps whose returns refine the flow below the cell's size, the pair's own two included, at
    /// most [`REFINEMENT_SWEEPS_MAX`]; 0 leaves whole cells.
    pub refinement_sweeps: u32,
    /// Tracklet filter.
    pub tracklet: TrackletParams,
    /// Beyond these two sweeps make no pair, and tracklets are dropped.
    pub limits: Limits,
}

/// Why a profile cannot run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileError {
    /// The offending field.
    pub field: &'static str,
    /// What it must be.
    pub must: &'static str,
}

impl Profile {
    /// 50 m around an HDL-64E on a car.
    pub fn hdl64() -> Profile {
        Profile {
            name: short("hdl64"),
            side: 167,
            levels: 14,
            voxel_m: 0.30,
            range_m: 100.0,
            frame: Frame::Lattice,
            deskew: true,
            // The refinement makes little of more: 20 bring half a point within 30 cm.
            em_rounds: 6,
            smoothing: 1000,
            displacement_cost: 1,
            outside_cost: COST_UNKNOWN,
            refinement_sweeps: 3,
            tracklet: TrackletParams {
                measurement_cells: 0.5,
                pose_noise_m: 0.005,
                speed_noise_mps2: 1.0,
                turn_noise_radps2: 0.6,
                turn_birth_radps: 0.2,
                gate_d2: 9.2103,
                innovation_sweeps: 8.0,
                birth: Birth::Target,
                takes_over: true,
                coast_sweeps: 2,
            },
            limits: Limits::DEFAULT,
        }
    }

    /// 70.5 m: what the graders of Argoverse 2 score.
    pub fn wide() -> Profile {
        // Farther away the energy minimisation takes longer to settle.
        Profile { name: short("wide"), side: 235, em_rounds: 20, ..Profile::hdl64() }
    }

    /// The author's choices where the text or his program differ from ours.
    pub fn dissertation() -> Profile {
        let base = Profile::hdl64();
        Profile {
            name: short("dissertation"),
            frame: Frame::Sensor,
            deskew: false,
            refinement_sweeps: 0,
            em_rounds: 20,
            // 14 log(p q + (1 - p)(1 - q)) with p, q at the clip bounds -1 and 3.
            outside_cost: 17_289,
            tracklet: TrackletParams {
                pose_noise_m: 0.0,
                speed_noise_mps2: 0.5,
                turn_noise_radps2: 0.3,
                // His gate compares the distance itself with the quantile 5.9915.
                gate_d2: 5.9915 * 5.9915,
                innovation_sweeps: 0.0,
                birth: Birth::Source,
                takes_over: false,
                coast_sweeps: 0,
                ..base.tracklet
            },
            ..base
        }
    }

    /// The sparse map: the sensor's whole range, in all directions.
    pub fn map() -> Profile {
        // 334 voxels either way: 100 m at 0.30 m; the keys of its voxels fit 31 bits.
        Profile { name: short("map"), side: 669, levels: 669, ..Profile::hdl64() }
    }

    /// The shipped profiles of the flow pipeline.
    pub fn named(name: &str) -> Option<Profile> {
        [Profile::hdl64(), Profile::wide(), Profile::dissertation()]
            .into_iter()
            .find(|p| p.name == name)
    }

    /// Columns of the window.
    pub fn columns(&self) -> usize {
        self.side as usize * self.side as usize
    }

    /// Voxels of the window.
    pub fn voxels(&self) -> usize {
        self.columns() * self.levels as usize
    }

    /// Voxels a ray is traced for at most, the slots per ray of B.2.1: m_r / r, rounded up.
    pub fn range_steps(&self) -> i32 {
        libm::ceil(self.range_m / self.voxel_m) as i32
    }

    /// Checks every field against its range and the ceilings.
    pub fn check(&self) -> Result<(), ProfileError> {
        let (t, l) = (&self.tracklet, &self.limits);
        let positive = |v: f32| v.is_finite() && v > 0.0;
        let rules: [(bool, &'static str, &'static str); 23] = [
            (self.side % 2 == 1 && self.side >= 31, "side", "odd and at least 31"),
            (self.columns() <= COLUMNS_MAX, "side", "at most 255 (65,536 columns)"),
            ((2..=LEVELS_MAX as u32).contains(&self.levels), "levels", "2 to 16"),
            ((0.05..=2.0).contains(&self.voxel_m), "voxel_m", "0.05 to 2.0"),
            (
                self.range_m > 0.0 && self.range_steps() <= 2000,
                "range_m",
                "above 0, at most 2,000 voxels",
            ),
            (self.em_rounds >= 1 && self.em_rounds <= 100, "em_rounds", "1 to 100"),
            (self.smoothing <= 10_000, "smoothing", "at most 10,000 (10 nats per cell²)"),
            (self.displacement_cost <= 1000, "displacement_cost", "at most 1,000"),
            (self.outside_cost <= 100_000, "outside_cost", "at most 100,000"),
            (
                self.refinement_sweeps != 1
                    && self.refinement_sweeps <= REFINEMENT_SWEEPS_MAX as u32,
                "refinement_sweeps",
                "0 or 2 to 4",
            ),
            (
                self.refinement_sweeps == 0 || self.frame == Frame::Lattice,
                "refinement_sweeps",
                "0 where the frame is the sensor's",
            ),
            (positive(t.measurement_cells), "measurement_cells", "above 0"),
            ((0.0..=1.0).contains(&t.pose_noise_m), "pose_noise_m", "0 to 1"),
            (positive(t.speed_noise_mps2), "speed_noise_mps2", "above 0"),
            (positive(t.turn_noise_radps2), "turn_noise_radps2", "above 0"),
            (positive(t.turn_birth_radps), "turn_birth_radps", "above 0"),
            (positive(t.gate_d2), "gate_d2", "above 0"),
            (
                t.innovation_sweeps == 0.0 || (1.0..=1000.0).contains(&t.innovation_sweeps),
                "innovation_sweeps",
                "0, or 1 to 1,000",
            ),
            (t.coast_sweeps <= 20, "coast_sweeps", "at most 20"),
            (l.gap_s > 0.0 && l.gap_s <= 10.0, "gap_s", "above 0, at most 10"),
            (l.jump_mps > 0.0 && l.jump_mps <= 1000.0, "jump_mps", "above 0, at most 1,000"),
            (l.spin_radps > 0.0 && l.spin_radps <= 100.0, "spin_radps", "above 0, at most 100"),
            (!self.name.is_empty(), "name", "not empty"),
        ];
        match rules.iter().find(|r| !r.0) {
            Some(&(_, field, must)) => Err(ProfileError { field, must }),
            None => Ok(()),
        }
    }
}

fn short(name: &str) -> String<24> {
    let mut s = String::new();
    // Literals of this file fit.
    let _ = s.push_str(name);
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_profiles_are_valid_and_named() {
        for name in ["hdl64", "wide", "dissertation"] {
            let p = Profile::named(name).unwrap();
            assert_eq!(p.name, name);
            assert_eq!(p.check(), Ok(()));
        }
        assert_eq!(Profile::named("nosuch"), None);
        assert_eq!(Profile::hdl64().range_steps(), 334);
        assert_eq!(Profile::hdl64().voxels(), 390_446);
        assert!(Profile::map().voxels() < 1 << 31);
    }

    #[test]
    fn ceilings_are_named() {
        let p = Profile { side: 301, ..Profile::hdl64() };
        assert_eq!(p.check().unwrap_err().field, "side");
        let p = Profile { levels: 17, ..Profile::hdl64() };
        assert_eq!(p.check().unwrap_err().field, "levels");
        let p = Profile { voxel_m: f64::NAN, ..Profile::hdl64() };
        assert_eq!(p.check().unwrap_err().field, "voxel_m");
    }
}
