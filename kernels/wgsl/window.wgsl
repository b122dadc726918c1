// The least energy of a column at any displacement, without smoothing, one workgroup per column.
// Twin: core/src/stages/window.rs

const ROW_QUADS = ROW_WORDS / 4u;

var<workgroup> rows: array<u32, 9>;
var<workgroup> least: atomic<u32>;
var<workgroup> place: atomic<u32>;

// Energy and place of the displacement at an element of the row, NONE if it leads outside.
fn energy_at(i: i32, j: i32, at: u32, cost: u32, outside: i32) -> vec2<u32> {
    let d = displacement_at(at);
    let square = d.x * d.x + d.y * d.y;
    let energy = u32(i32(cost) + sweep.displacement_cost * square + outside);
    let may_be = d.y <= REACH && inside_square(i + d.x, j + d.y, sweep.side);
    return vec2<u32>(select(NONE, energy, may_be), at);
}

fn lesser(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return select(a, b, b.x < a.x);
}

@compute @workgroup_size(ROW_WORKGROUP)
fn window(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let column = i32(foreground.d[group.x]);
    let i = column / sweep.side;
    let j = column % sweep.side;
    if lane < 9u {
        let neighbour = column_around(i, j, 1, i32(lane), sweep.side);
        // The cost of one outside the window is the same at every displacement: added below.
        rows[lane] = NONE - 1u;
        if neighbour >= 0 {
            rows[lane] = foreground_index.d[neighbour];
        }
    }
    if lane == 0u {
        atomicStore(&least, NONE);
        atomicStore(&place, NONE);
    }
    workgroupBarrier();
    var unknown = 0u;
    var outside = 0;
    for (var n = 0; n < 9; n += 1) {
        unknown += select(0u, COST_UNKNOWN, rows[n] == NONE);
        outside += select(0, sweep.outside_cost, rows[n] == NONE - 1u);
    }
    var mine = vec2<u32>(NONE);
    for (var quad = lane; quad < ROW_QUADS; quad += ROW_WORKGROUP) { // <= ROW_QUADS / ROW_WORKGROUP + 1
        // Eight costs at once: sums of nine of at most COST_MAX never carry.
        var sum = vec4<u32>(unknown | (unknown << 16u));
        for (var n = 0; n < 9; n += 1) {
            if rows[n] < FOREGROUND_MAX {
                sum += pair_cost.d[rows[n] * ROW_QUADS + quad];
            }
        }
        for (var n = 0u; n < 8u; n += 1u) {
            let cost = (sum[n / 2u] >> (16u * (n & 1u))) & 0xffffu;
            mine = lesser(mine, energy_at(i, j, 8u * quad + n, cost, outside));
        }
    }
    atomicMin(&least, mine.x);
    workgroupBarrier();
    if mine.x == atomicLoad(&least) {
        atomicMin(&place, mine.y);
    }
    workgroupBarrier();
    if lane == 0u {
        min_cost.d[group.x] = vec2<u32>(atomicLoad(&least), atomicLoad(&place));
    }
}
