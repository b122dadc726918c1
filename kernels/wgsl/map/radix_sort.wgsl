// Stable radix sort of updates by key, 4 bits per pass. Twin: core/src/stages/map/radix_sort.rs
//
// A pass: `histogram` counts the digits of every tile, a prefix sum over (digit, tile) determines
// where each tile's share of a digit goes, `scatter` ranks the keys within the tile and writes
// them, `next_digit` moves on. No subgroup size is assumed. What is written to workgroup memory and
// read within control flow costs software devices time lane by lane: an invocation counts its own
// keys in registers, and there are few barriers.

const SORTERS = ROW_WORKGROUP;
const EACH = TILE / SORTERS;
// A byte holds the count of each digit, and four words have four each.
const_assert EACH < 256u && RADIX == 16u;
const ROWS = RADIX / 2u;
// Invocations per row, and the words of it that each sums.
const ROW_SORTERS = SORTERS / ROWS;
const SPAN = SORTERS / ROW_SORTERS;
// Word `row * SORTERS + t` has the counts of invocation t: of the digit `row` in the low half, of
// the digit `row + ROWS` in the high half.
var<workgroup> counts: array<u32, ROWS * SORTERS>;
var<workgroup> sums: array<u32, SORTERS>;

fn digit_of(key: u32, shift: u32) -> u32 {
    return (key >> shift) & (RADIX - 1u);
}

// One in the place of a digit: four digits share a word, a byte each.
fn unit(digit: u32) -> vec4<u32> {
    let one = vec4<u32>(1u << (8u * (digit % 4u)));
    return select(vec4<u32>(), one, vec4<u32>(digit / 4u) == vec4<u32>(0u, 1u, 2u, 3u));
}

// Shares the counts of an invocation's own keys, and sums a span of a row.
fn share_counts(lane: u32, own: vec4<u32>) {
    for (var row = 0u; row < ROWS; row += 1u) {
        let shift = 8u * (row % 4u);
        let low = select(own.x, own.y, row >= 4u) >> shift;
        let high = select(own.z, own.w, row >= 4u) >> shift;
        counts[row * SORTERS + lane] = (low & 0xffu) | ((high & 0xffu) << 16u);
    }
    workgroupBarrier();
    var sum = 0u;
    for (var n = 0u; n < SPAN; n += 1u) {
        sum += counts[lane * SPAN + n];
    }
    sums[lane] = sum;
    workgroupBarrier();
}

@compute @workgroup_size(SORTERS)
fn histogram(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = count_tiles.d[TILE];
    let shift = counters.d[DIGIT_SHIFT];
    var own = vec4<u32>();
    for (var n = 0u; n < EACH; n += 1u) {
        let index = group.x * TILE + n * SORTERS + lane;
        let digit = digit_of(unsorted.d[index].x, shift);
        own += select(vec4<u32>(), unit(digit), index < count);
    }
    share_counts(lane, own);
    let row = lane % ROWS;
    var total = 0u;
    for (var n = 0u; n < ROW_SORTERS; n += 1u) {
        total += sums[row * ROW_SORTERS + n];
    }
    if lane < RADIX {
        histograms.d[lane * groups.x + group.x] = (total >> (16u * (lane / ROWS))) & 0xffffu;
    }
}

@compute @workgroup_size(SORTERS)
fn scatter(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = count_tiles.d[TILE];
    let shift = counters.d[DIGIT_SHIFT];
    let first = group.x * TILE + lane * EACH;
    var own = vec4<u32>();
    for (var n = 0u; n < EACH; n += 1u) {
        let digit = digit_of(unsorted.d[first + n].x, shift);
        own += select(vec4<u32>(), unit(digit), first + n < count);
    }
    share_counts(lane, own);
    // An exclusive prefix sum of each row.
    var before = 0u;
    for (var n = 0u; n < ROW_SORTERS - 1u; n += 1u) {
        let other = lane - lane % ROW_SORTERS + n;
        before += select(0u, sums[other], other < lane);
    }
    for (var n = 0u; n < SPAN; n += 1u) {
        let here = counts[lane * SPAN + n];
        counts[lane * SPAN + n] = before;
        before += here;
    }
    workgroupBarrier();
    own = vec4<u32>();
    for (var n = 0u; n < EACH; n += 1u) {
        let update = unsorted.d[first + n];
        let digit = digit_of(update.x, shift);
        let word = counts[(digit % ROWS) * SORTERS + lane];
        let earlier = (dot(own, min(unit(digit), vec4<u32>(1u))) >> (8u * (digit % 4u))) & 0xffu;
        own += unit(digit);
        let rank = ((word >> (16u * (digit / ROWS))) & 0xffffu) + earlier;
        let place = digit_offsets.d[digit * groups.x + group.x] + rank;
        // What lies beyond the last update stays there.
        sorted.d[select(first + n, place, first + n < count)] = update;
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
