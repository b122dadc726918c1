// Sums costs over the 3x3 window, one workgroup a column. Twin: core/src/stages/window.rs

const ROW_QUADS = ROW_WORDS / 4u;

var<workgroup> rows: array<u32, 9>;

@compute @workgroup_size(ROW_WORKGROUP)
fn window(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let column = i32(foreground.d[group.x]);
    if lane < 9u {
        let i = column / sweep.side + i32(lane) / 3 - 1;
        let j = column % sweep.side + i32(lane) % 3 - 1;
        // A neighbour outside costs nothing here: see `outside_cost`.
        rows[lane] = NONE - 1u;
        if i >= 0 && i < sweep.side && j >= 0 && j < sweep.side {
            rows[lane] = foreground_index.d[i * sweep.side + j];
        }
    }
    workgroupBarrier();
    var unknown = 0u;
    for (var n = 0; n < 9; n += 1) {
        unknown += select(0u, COST_UNKNOWN, rows[n] == NONE);
    }
    for (var quad = lane; quad < ROW_QUADS; quad += ROW_WORKGROUP) { // <= ROW_QUADS / ROW_WORKGROUP + 1
        // Eight costs at once: nine of at most COST_MAX never carry.
        var sum = vec4<u32>(unknown | (unknown << 16u));
        for (var n = 0; n < 9; n += 1) {
            if rows[n] < FOREGROUND_MAX {
                sum += pair_cost.d[rows[n] * ROW_QUADS + quad];
            }
        }
        window_cost.d[group.x * ROW_QUADS + quad] = sum;
    }
}
