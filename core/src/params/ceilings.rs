//! Ceilings that size storage, and the constants of the wire format shared with the kernels.

/// Returns of one sweep that any profile may take: those of four HDL-32E at full rate, or of an
/// OS1-128 at 2048 x 10. (The dissertation's n_max is 150,000.)
pub const POINTS_MAX: usize = 262_144;
/// Levels of a column: free and occupied masks share one 32-bit word. No profile needs more.
/// Compared with 32 levels this halves the memory traffic, and the masks of 16 columns fit in a
/// vector of AVX2.
pub const LEVELS_MAX: usize = 16;
/// Columns of the flow window along an axis: 101 m at 0.30 m.
pub const SIDE_MAX: usize = 337;
/// Columns of the flow window.
pub const COLUMNS_MAX: usize = (SIDE_MAX * SIDE_MAX).next_multiple_of(TILE);
/// Solid columns of one sweep for which flow is output; further ones, in column order, are left out
/// and counted. The busiest sweep seen has 8,795 in a 50 m window.
pub const SOLID_MAX: usize = 32_768;
/// Clusters of one sweep, whole and in parts; columns of further ones are taken to be static, and
/// counted. Eight times enough for every sweep seen, in a 100 m window too.
pub const CLUSTERS_MAX: usize = 8192;
/// Foreground columns of one sweep; further ones, in column order, are dropped and counted.
/// The busiest drives seen have 5,800 on average in a 100 m window (`--profile far`).
pub const FOREGROUND_MAX: usize = 10_240;
/// Time slots a sweep is divided into for ray origins and motion correction: 1.6 ms at 10 Hz.
pub const SLOTS: usize = 64;
/// Sensors a rig may have.
pub const SENSORS_MAX: usize = 8;
/// Distinct ray origins of a sweep: every sensor in every slot.
pub const ORIGINS_MAX: usize = SENSORS_MAX * SLOTS;
/// Half width of the search, cells (n_s = 31, section 3.8.1): 45 m/s at 0.30 m and 10 Hz.
pub const REACH: i32 = 15;
/// Width of the search, cells.
pub const SIDE: usize = 2 * REACH as usize + 1;
/// Elements from one line of the search to the next: [`SIDE`] and one of padding. Shifts and masks
/// turn an index into its displacement, without a division, and a row is a whole number of `vec4`s.
/// The padding costs at most 0.8 MB.
pub const LINE: usize = 32;
/// Elements of a row of costs, one row per foreground column: displacement `(du, dv)` is element
/// `(du + REACH) * LINE + dv + REACH`, the order in which ties are broken.
pub const ROW: usize = SIDE * LINE;
/// Words of a row: two 16-bit costs per word.
pub const ROW_WORDS: usize = ROW / 2;
/// Slots of the table that merges equal rays: twice the points, so that it is at most half full.
pub const MERGE_SLOTS: usize = 2 * POINTS_MAX;
/// Probes of that table before a ray is traced on its own.
pub const MERGE_PROBES: u32 = 64;
/// Maximum distance of a return from the window's corner along an axis, voxels; farther ones are
/// dropped.
pub const EXTENT_VOXELS: i32 = 4095;
/// Maximum number of voxels for which a ray may be traced.
pub const RANGE_STEPS_MAX: i32 = 2000;
/// Maximum number of sweeps that the refinement of the flow may remember.
pub const REFINEMENT_SWEEPS_MAX: usize = 7;
/// Maximum number of levels above the ground in a cluster: those of a column share one 32-bit word.
pub const CLUSTER_LEVELS_MAX: usize = 32;
/// Sub-voxels along an axis of a voxel, each of which keeps one return.
pub const SUBVOXELS_MAX: usize = 4;
/// Thinned returns of one sweep that the refinement keeps; those of the last columns are dropped
/// and counted.
pub const CLOUD_MAX: usize = 65_535;
/// Rays of one sweep that serve as sightlines to decide whether something was visible; of more, an
/// evenly spread subset. With all of them, recall on simulated streets is 94.8 % instead of 94.7
/// (21 drives of 25 sweeps).
pub const SIGHTLINES_MAX: usize = 65_536;
/// Updates (voxel, log-odds) of one band of the sparse map.
pub const BAND_UPDATES: usize = 1 << 20;
/// Threads per workgroup of most one-dimensional kernels.
pub const WORKGROUP: usize = 256;
/// Threads per workgroup if each handles a ray, a foreground column or several keys of the radix
/// sort, or all of them one column.
pub const ROW_WORKGROUP: usize = 64;
/// Items that a workgroup of the prefix sum or of the radix sort handles.
pub const TILE: usize = 1024;
/// Digit values of one radix pass (4 bits).
pub const RADIX: usize = 16;

/// Units of log-odds in a nat: tenths, so that sums of updates are exact.
pub const LOG_ODDS_PER_NAT: f32 = 10.0;
/// Log-odds of a voxel that a ray passes, tenths (Table B.1: -0.1).
pub const LOG_ODDS_FREE: i32 = -1;
/// Log-odds of a voxel in which a ray ends, tenths (Table B.1: 1.0).
pub const LOG_ODDS_OCCUPIED: i32 = 10;
/// Minimum log-odds of a solid voxel, tenths: p > 0.6, the author's test for a column worth
/// matching.
pub const LOG_ODDS_SOLID: i32 = 5;
/// `-log 0.5` in thousandths of a nat: the cost of an uninformative window neighbour.
pub const COST_UNKNOWN: u32 = 693;
/// Height of the HDL-64E above ground on KITTI's car, m: levels are anchored to it, so that the
/// learned weights of a level apply to the same height on any vehicle.
pub const ANCHOR_ABOVE_GROUND_M: f64 = 1.73;

const _: () = assert!(SIDE < LINE && LINE.is_power_of_two() && ROW_WORDS.is_multiple_of(4));
const _: () = assert!(MERGE_SLOTS.is_power_of_two());
const _: () = assert!(BAND_UPDATES <= TILE * TILE);
const _: () = assert!(COLUMNS_MAX <= TILE * TILE);
