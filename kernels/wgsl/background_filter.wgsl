// Marks the foreground of the previous sweep. Twin: core/src/stages/background_filter.rs

fn score(column: i32) -> i32 {
    let side = sweep.side;
    let i = column / side;
    let j = column % side;
    var sum = filter_table.d[FILTER_TABLE];
    for (var di = -2; di <= 2; di += 1) {
        for (var dj = -2; dj <= 2; dj += 1) {
            let ni = i + di;
            let nj = j + dj;
            if ni >= 0 && ni < side && nj >= 0 && nj < side {
                let state = columns_before.d[ni * side + nj].x;
                let patch_at = u32((di + 2) * 5 + dj + 2) * 1024u;
                sum += filter_table.d[patch_at + (state & 0xffu)]
                    + filter_table.d[patch_at + 256u + ((state >> 8u) & 0xffu)]
                    + filter_table.d[patch_at + 512u + ((state >> 16u) & 0xffu)]
                    + filter_table.d[patch_at + 768u + (state >> 24u)];
            }
        }
    }
    return sum;
}

var<workgroup> count: atomic<u32>;
var<workgroup> solid: array<u32, TILE>;

// Lists the solid ones among TILE columns, then scores them. The columns are spread over the whole
// window, so that every workgroup has about as many solid ones.
@compute @workgroup_size(ROW_WORKGROUP)
fn background_filter(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        atomicStore(&count, 0u);
    }
    workgroupBarrier();
    for (var n = 0u; n < TILE / ROW_WORKGROUP; n += 1u) {
        let column = (n * groups.x + group.x) * ROW_WORKGROUP + lane;
        if column < u32(sweep.side * sweep.side) {
            let is_solid = columns_before.d[column].y != 0u;
            if is_solid && sweep.unfiltered == 0 {
                solid[atomicAdd(&count, 1u)] = column;
            } else {
                foreground_marks.d[column] = select(0u, 1u, is_solid);
            }
        }
    }
    workgroupBarrier();
    let listed = atomicLoad(&count);
    var n = lane;
    // The exit comes last: if it came first, software devices would go through the loop once more.
    loop { // <= TILE / ROW_WORKGROUP
        if n < listed {
            let column = solid[n];
            foreground_marks.d[column] = select(0u, 1u, score(i32(column)) > 0);
        }
        n += ROW_WORKGROUP;
        if n >= listed {
            break;
        }
    }
}
