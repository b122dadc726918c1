//! Every buffer of the flow pipeline, declared once: what a device allocates, what the scalar
//! backend allocates, what the kernels bind and what `memory-layout.md` lists.

use crate::background_filter::TABLE_WORDS;
use crate::occupancy_constancy::{SCORES_MAX, WEIGHT_WORDS};
use crate::params::{
    BAND_UPDATES, FOREGROUND_MAX, MERGE_SLOTS, ORIGINS_MAX, POINTS_MAX, Profile, RADIX, ROW_WORDS,
    TILE,
};
use crate::record::Step;

/// Where a buffer lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heap {
    /// Written by the host, read by copies.
    Upload,
    /// The device's own.
    Device,
    /// Written by copies, read by the host.
    Readback,
}

/// One buffer.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Name, the same in the kernels.
    pub name: &'static str,
    /// Heap.
    pub heap: Heap,
    /// Element, as the kernels see it.
    pub element: &'static str,
    /// Words (of 32 bits) of an element.
    pub words: usize,
    /// Elements for a profile.
    pub count: fn(&Profile) -> usize,
    /// What it holds.
    pub doc: &'static str,
}

impl Row {
    /// Bytes for a profile.
    pub fn bytes(&self, profile: &Profile) -> usize {
        4 * self.words * (self.count)(profile)
    }
}

macro_rules! buffers {
    ($(#[$m:meta])* $enum:ident, $table:ident: $( $id:ident $name:literal $heap:ident $element:literal * $words:expr, |$p:ident| $count:expr, $doc:literal; )*) => {
        $(#[$m])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $enum { $( #[doc = $doc] $id ),* }

        impl $enum {
            /// The row of this buffer.
            pub fn row(self) -> &'static Row { &$table[self as usize] }
        }

        /// The table, in the order of the enumeration.
        pub const $table: &[Row] = &[ $( Row {
            name: $name, heap: Heap::$heap, element: $element, words: $words,
            count: |$p| $count, doc: $doc,
        } ),* ];
    };
}

buffers! {
    /// Buffers of the flow pipeline.
    Buffer, BUFFERS:
    StepIn "params_in" Upload "u32" * 1, |_p| Step::WORDS, "record `Step` of the sweep";
    OriginsIn "origins_in" Upload "vec4<i32>" * 4, |_p| ORIGINS_MAX, "voxels of the ray origins";
    RaysIn "rays_in" Upload "vec2<u32>" * 2, |_p| POINTS_MAX, "rays of the sweep";
    FilterIn "filter_in" Upload "i32" * 1, |_p| TABLE_WORDS, "background filter, once at start";
    WeightsIn "weights_in" Upload "i32" * 1, |_p| WEIGHT_WORDS, "constancy weights, once at start";
    CostsIn "costs_in" Upload "u32" * 1, |_p| SCORES_MAX, "costs of scores, once at start";
    StepNow "params" Device "u32" * 1, |_p| Step::WORDS, "record `Step`";
    Origins "origins" Device "vec4<i32>" * 4, |_p| ORIGINS_MAX, "voxels of the ray origins";
    Rays "rays" Device "vec2<u32>" * 2, |_p| POINTS_MAX, "rays";
    Filter "filter_table" Device "i32" * 1, |_p| TABLE_WORDS, "background filter by mask byte";
    Weights "constancy_weights" Device "i32" * 1, |_p| WEIGHT_WORDS, "constancy weights by level";
    Costs "constancy_costs" Device "u32" * 1, |_p| SCORES_MAX, "cost of each score, 1/1000 nat";
    Slots "slots" Device "vec2<u32>" * 2, |_p| MERGE_SLOTS, "distinct rays: 1 + index of one, and how many";
    Distinct "distinct" Device "u32" * 1, |_p| POINTS_MAX, "used slots";
    Counters "counters" Device "atomic<u32>" * 1, |_p| COUNTERS, "counts and indirect group counts";
    LogOdds "log_odds" Device "atomic<i32>" * 1, |p| p.voxels(), "log-odds of every voxel, tenths";
    Now "columns_now" Device "vec2<u32>" * 2, |p| p.columns(), "columns of this sweep";
    Before "columns_before" Device "vec2<u32>" * 2, |p| p.columns(), "columns of the sweep before, in this window";
    Marks "marks" Device "u32" * 1, |p| p.columns(), "1 where a column is foreground";
    Tiles "tiles" Device "u32" * 1, |_p| TILE + 1, "sums of the tiles of the prefix sum, sum of all";
    Rank "rank" Device "u32" * 1, |p| p.columns(), "position of a column in the foreground";
    Foreground "foreground" Device "u32" * 1, |_p| FOREGROUND_MAX, "foreground columns, ascending";
    Cost "cost" Device "vec4<u32>" * 4, |_p| FOREGROUND_MAX * ROW_WORDS / 4, "costs of pairs of columns, two 16-bit values a word";
    Matching "matching" Device "vec4<u32>" * 4, |_p| FOREGROUND_MAX * ROW_WORDS / 4, "costs summed over the 3x3 window (T, 3.13)";
    State "state" Device "u32" * 1, |p| p.columns(), "flow of every column";
    TargetEnergy "target_energy" Device "atomic<u32>" * 1, |p| p.columns(), "energy of the winner at every target";
    TargetRank "target_rank" Device "atomic<u32>" * 1, |p| p.columns(), "rank of the winner at every target";
    Proposal "proposal" Device "vec2<u32>" * 2, |_p| FOREGROUND_MAX, "flow and energy each foreground column proposes";
    Least "least" Device "vec2<u32>" * 2, |_p| FOREGROUND_MAX, "least energy of a foreground column, and where";
    CountersOut "counters_out" Readback "u32" * 1, |_p| COUNTERS, "counts";
    NowOut "columns_now_out" Readback "vec2<u32>" * 2, |p| p.columns(), "columns of this sweep";
    BeforeOut "columns_before_out" Readback "vec2<u32>" * 2, |p| p.columns(), "columns of the sweep before";
    ForegroundOut "foreground_out" Readback "u32" * 1, |_p| FOREGROUND_MAX, "foreground columns";
    StateOut "state_out" Readback "u32" * 1, |p| p.columns(), "flow of every column";
    ProposalOut "proposal_out" Readback "vec2<u32>" * 2, |_p| FOREGROUND_MAX, "last proposals";
}

/// Words of the counters: distinct rays, foreground listed, foreground marked, spare; then three
/// group counts and a spare for each indirect dispatch.
pub const COUNTERS: usize = 16;
/// Word of the number of distinct rays.
pub const DISTINCT_COUNT: usize = 0;
/// Word of the number of foreground columns listed.
pub const FOREGROUND_COUNT: usize = 1;
/// Word of the number of foreground columns marked.
pub const FOREGROUND_MARKED: usize = 2;
/// First word of the group counts, one thread per distinct ray.
pub const GROUPS_DISTINCT: usize = 4;
/// First word of the group counts, one thread per foreground column.
pub const GROUPS_FOREGROUND: usize = 8;
/// First word of the group counts, one group per foreground column.
pub const GROUPS_ROWS: usize = 12;

buffers! {
    /// Buffers of the sparse map.
    MapBuffer, MAP_BUFFERS:
    StepIn "params_in" Upload "u32" * 1, |_p| Step::WORDS, "record `Step` of the sweep and band";
    OriginsIn "origins_in" Upload "vec4<i32>" * 4, |_p| ORIGINS_MAX, "voxels of the ray origins";
    RaysIn "rays_in" Upload "vec2<u32>" * 2, |_p| POINTS_MAX, "rays of the sweep";
    StepNow "params" Device "u32" * 1, |_p| Step::WORDS, "record `Step`";
    Origins "origins" Device "vec4<i32>" * 4, |_p| ORIGINS_MAX, "voxels of the ray origins";
    Rays "rays" Device "vec2<u32>" * 2, |_p| POINTS_MAX, "rays";
    Slots "slots" Device "vec2<u32>" * 2, |_p| MERGE_SLOTS, "distinct rays: 1 + index of one, and how many";
    Distinct "distinct" Device "u32" * 1, |_p| POINTS_MAX, "used slots";
    Counters "counters" Device "atomic<u32>" * 1, |_p| COUNTERS, "counts, shift of the digit";
    Counts "counts" Device "u32" * 1, |_p| POINTS_MAX, "updates of each distinct ray in the band";
    Offsets "offsets" Device "u32" * 1, |_p| POINTS_MAX, "where its updates start";
    CountTiles "count_tiles" Device "u32" * 1, |_p| TILE + 1, "tiles of their prefix sum, updates of the band";
    Updates "updates" Device "vec2<u32>" * 2, |_p| BAND_UPDATES, "updates (key, log-odds), then sorted";
    Scratch "scratch" Device "vec2<u32>" * 2, |_p| BAND_UPDATES, "the other side of a radix pass, then voxels";
    Histograms "histograms" Device "u32" * 1, |_p| RADIX * BAND_UPDATES / TILE, "digits of each tile";
    DigitOffsets "digit_offsets" Device "u32" * 1, |_p| RADIX * BAND_UPDATES / TILE, "where they go";
    DigitTiles "digit_tiles" Device "u32" * 1, |_p| TILE + 1, "tiles of their prefix sum";
    Heads "heads" Device "u32" * 1, |_p| BAND_UPDATES, "1 where a key is new";
    Runs "runs" Device "u32" * 1, |_p| BAND_UPDATES, "voxels before";
    RunTiles "run_tiles" Device "u32" * 1, |_p| TILE + 1, "tiles of their prefix sum, voxels of the band";
    CountOut "count_out" Readback "u32" * 1, |_p| TILE + 1, "updates of the band, last word";
    RunsOut "runs_out" Readback "u32" * 1, |_p| TILE + 1, "voxels of the band, last word";
    VoxelsOut "voxels_out" Readback "vec2<u32>" * 2, |_p| BAND_UPDATES, "voxels of the band";
}

/// Word of the sparse map's counters that holds the shift of the radix pass.
pub const DIGIT_SHIFT: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_fit_their_profiles() {
        assert_eq!(Buffer::Least.row().name, "least");
        assert_eq!(Buffer::StepIn.row().name, "params_in");
        for profile in [Profile::hdl64(), Profile::wide(), Profile::dissertation()] {
            // 128 MiB is the least a Vulkan device must let a shader bind.
            assert!(BUFFERS.iter().all(|b| b.bytes(&profile) <= 128 << 20));
        }
        let total: usize = BUFFERS.iter().map(|b| b.bytes(&Profile::hdl64())).sum();
        assert!(total <= 64 << 20, "{total} bytes");
    }
}
