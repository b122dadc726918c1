// Exclusive prefix sum of a whole buffer: reduce, then scan. Twin: core/src/stages/prefix_sum.rs
//
// `reduce` sums tiles of TILE values, `spine` scans the sums of up to TILE tiles in one workgroup
// and stores the total after them, `scan` scans within each tile and adds the tile's offset.
// Uses workgroup memory only: no subgroups or forward progress between workgroups are assumed.

const EACH = TILE / WORKGROUP;
const SPAN = 16u;
var<workgroup> partial: array<u32, WORKGROUP>;
var<workgroup> spans: array<u32, WORKGROUP / SPAN>;

fn value_at(index: u32) -> u32 {
    if index < arrayLength(&values.d) {
        return values.d[index];
    }
    return 0u;
}

// Exclusive prefix sum over the workgroup of one number per invocation: within spans, then over
// their sums. Few barriers: on software devices each costs time per invocation.
fn scan_workgroup(lane: u32, mine: u32) -> u32 {
    partial[lane] = mine;
    workgroupBarrier();
    var before = 0u;
    for (var n = lane - lane % SPAN; n < lane; n += 1u) { // <= SPAN - 1
        before += partial[n];
    }
    if lane % SPAN == SPAN - 1u {
        spans[lane / SPAN] = before + mine;
    }
    workgroupBarrier();
    for (var n = 0u; n < lane / SPAN; n += 1u) { // <= WORKGROUP / SPAN - 1
        before += spans[n];
    }
    return before;
}

@compute @workgroup_size(WORKGROUP)
fn reduce(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var sum = 0u;
    for (var n = 0u; n < EACH; n += 1u) {
        sum += value_at(group.x * TILE + lane * EACH + n);
    }
    let before = scan_workgroup(lane, sum);
    if lane == WORKGROUP - 1u {
        tiles.d[group.x] = before + sum;
    }
}

@compute @workgroup_size(WORKGROUP)
fn spine(@builtin(local_invocation_index) lane: u32) {
    let tiles_used = (arrayLength(&values.d) + TILE - 1u) / TILE;
    var own: array<u32, EACH>;
    var sum = 0u;
    for (var n = 0u; n < EACH; n += 1u) {
        let tile = lane * EACH + n;
        own[n] = sum;
        if tile < tiles_used {
            sum += tiles.d[tile];
        }
    }
    let before = scan_workgroup(lane, sum);
    if lane == WORKGROUP - 1u {
        tiles.d[TILE] = before + sum;
    }
    for (var n = 0u; n < EACH; n += 1u) {
        let tile = lane * EACH + n;
        if tile < tiles_used {
            tiles.d[tile] = before + own[n];
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn scan(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var own: array<u32, EACH>;
    var sum = 0u;
    let first = group.x * TILE + lane * EACH;
    for (var n = 0u; n < EACH; n += 1u) {
        own[n] = sum;
        sum += value_at(first + n);
    }
    let before = tiles.d[group.x] + scan_workgroup(lane, sum);
    for (var n = 0u; n < EACH; n += 1u) {
        if first + n < arrayLength(&sums.d) {
            sums.d[first + n] = before + own[n];
        }
    }
}
