// Sums costs over the 3x3 window, one workgroup a column. Twin: core/src/window.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Words { d: array<u32> }
@group(0) @binding(1) var<storage, read> foreground: Words;
@group(0) @binding(2) var<storage, read> rank: Words;
struct Quads { d: array<vec4<u32>> }
@group(0) @binding(3) var<storage, read> cost: Quads;
@group(0) @binding(4) var<storage, read_write> matching: Quads;

const ROW_QUADS = ROW_WORDS / 4u;

var<workgroup> rows: array<u32, 9>;

@compute @workgroup_size(ROW_WORKGROUP)
fn window(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let column = i32(foreground.d[group.x]);
    if lane < 9u {
        let i = column / params.side + i32(lane) / 3 - 1;
        let j = column % params.side + i32(lane) % 3 - 1;
        // A neighbour outside costs nothing here: see `outside_cost`.
        rows[lane] = NONE - 1u;
        if i >= 0 && i < params.side && j >= 0 && j < params.side {
            rows[lane] = rank.d[i * params.side + j];
        }
    }
    workgroupBarrier();
    var unknown = 0u;
    for (var n = 0; n < 9; n += 1) { // <= 9
        unknown += select(0u, COST_UNKNOWN, rows[n] == NONE);
    }
    for (var quad = lane; quad < ROW_QUADS; quad += ROW_WORKGROUP) { // <= 2
        // Eight costs at once: nine of at most COST_MAX never carry.
        var sum = vec4<u32>(unknown | (unknown << 16u));
        for (var n = 0; n < 9; n += 1) { // <= 9
            if rows[n] < FOREGROUND_MAX {
                sum += cost.d[rows[n] * ROW_QUADS + quad];
            }
        }
        matching.d[group.x * ROW_QUADS + quad] = sum;
    }
}
