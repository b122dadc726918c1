// Stable radix sort of updates by key, 4 bits per pass. Twin: core/src/stages/map/radix_sort.rs
//
// A pass: `histogram` counts the digits of every tile, a prefix sum over (digit, tile) determines
// where each tile's share of a digit goes, `scatter` ranks the keys within the tile and writes
// them, `next_digit` moves on. Ranks come from per-invocation counts scanned across the workgroup:
// no subgroup size is assumed. Counts of two digits share a word, so that all fit in 8 KiB.

const EACH = TILE / WORKGROUP;
const HALF = RADIX / 2u;
var<workgroup> totals: array<atomic<u32>, RADIX>;
var<workgroup> ranks: array<u32, 2048>;
var<workgroup> partial: array<u32, WORKGROUP>;

fn digit_of(key: u32) -> u32 {
    return (key >> counters.d[DIGIT_SHIFT]) & (RADIX - 1u);
}

@compute @workgroup_size(WORKGROUP)
fn histogram(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane < RADIX {
        atomicStore(&totals[lane], 0u);
    }
    workgroupBarrier();
    for (var n = 0u; n < EACH; n += 1u) {
        let index = group.x * TILE + n * WORKGROUP + lane;
        if index < count_tiles.d[TILE] {
            atomicAdd(&totals[digit_of(unsorted.d[index].x)], 1u);
        }
    }
    workgroupBarrier();
    if lane < RADIX {
        histograms.d[lane * groups.x + group.x] = atomicLoad(&totals[lane]);
    }
}

@compute @workgroup_size(WORKGROUP)
fn scatter(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    // Digit d of invocation t is counted in word (d % 8) * 256 + t, low or high half.
    for (var row = 0u; row < HALF; row += 1u) {
        ranks[row * WORKGROUP + lane] = 0u;
    }
    let first = group.x * TILE + lane * EACH;
    let end = min(count_tiles.d[TILE], first + EACH);
    for (var index = first; index < end; index += 1u) { // <= EACH
        let digit = digit_of(unsorted.d[index].x);
        ranks[(digit % HALF) * WORKGROUP + lane] += 1u << (16u * (digit / HALF));
    }
    workgroupBarrier();
    // Each row of 256 words is scanned by 32 invocations, 8 words each.
    var sum = 0u;
    for (var n = 0u; n < 8u; n += 1u) {
        let count = ranks[lane * 8u + n];
        ranks[lane * 8u + n] = sum;
        sum += count;
    }
    partial[lane] = sum;
    workgroupBarrier();
    for (var reach = 1u; reach < 32u; reach *= 2u) { // <= 5
        var from_left = 0u;
        if lane % 32u >= reach {
            from_left = partial[lane - reach];
        }
        workgroupBarrier();
        partial[lane] += from_left;
        workgroupBarrier();
    }
    let before = partial[lane] - sum;
    for (var n = 0u; n < 8u; n += 1u) {
        ranks[lane * 8u + n] += before;
    }
    workgroupBarrier();
    for (var index = first; index < end; index += 1u) { // <= EACH
        let update = unsorted.d[index];
        let digit = digit_of(update.x);
        let word = (digit % HALF) * WORKGROUP + lane;
        let half = 16u * (digit / HALF);
        let rank = (ranks[word] >> half) & 0xffffu;
        ranks[word] += 1u << half;
        sorted.d[digit_offsets.d[digit * groups.x + group.x] + rank] = update;
    }
}

@compute @workgroup_size(1)
fn first_digit() {
    counters.d[DIGIT_SHIFT] = 0u;
}

@compute @workgroup_size(1)
fn next_digit() {
    counters.d[DIGIT_SHIFT] += 4u;
}
