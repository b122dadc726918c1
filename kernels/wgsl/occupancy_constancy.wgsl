// Costs of a foreground column at every displacement, one workgroup a column.
// Twin: core/src/occupancy_constancy.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Numbers { d: array<i32> }
@group(0) @binding(1) var<storage, read> constancy_weights: Numbers;
struct Words { d: array<u32> }
@group(0) @binding(2) var<storage, read> constancy_costs: Words;
@group(0) @binding(3) var<storage, read> foreground: Words;
struct Columns { d: array<vec2<u32>> }
@group(0) @binding(4) var<storage, read> columns_before: Columns;
@group(0) @binding(5) var<storage, read> columns_now: Columns;
@group(0) @binding(6) var<storage, read_write> cost: Words;

var<workgroup> bits: array<i32, 32>;
var<workgroup> bytes: array<i32, 1024>;

// What a mask bit of a target adds to the score of the source.
fn bit_weight(source: u32, bit: u32) -> i32 {
    let k = bit & 15u;
    let free = constancy_weights.d[k];
    let occupied = constancy_weights.d[LEVELS_MAX + k];
    let mixed = constancy_weights.d[2u * LEVELS_MAX + k];
    if ((source >> k) & 1u) == 1u {
        return select(mixed, free, bit < 16u);
    }
    if ((source >> (16u + k)) & 1u) == 1u {
        return select(occupied, mixed, bit < 16u);
    }
    return 0;
}

fn cost_at(i: i32, j: i32, displacement: u32, offset: i32) -> u32 {
    let ti = i + i32(displacement / SIDE) - REACH;
    let tj = j + i32(displacement % SIDE) - REACH;
    var state = 0u;
    if ti >= 0 && ti < params.side && tj >= 0 && tj < params.side {
        state = columns_now.d[ti * params.side + tj].x;
    }
    let score = bytes[state & 0xffu]
        + bytes[256u + ((state >> 8u) & 0xffu)]
        + bytes[512u + ((state >> 16u) & 0xffu)]
        + bytes[768u + (state >> 24u)];
    return constancy_costs.d[score + offset];
}

@compute @workgroup_size(ROW_WORKGROUP)
fn occupancy_constancy(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let column = i32(foreground.d[group.x]);
    if lane < 32u {
        bits[lane] = bit_weight(columns_before.d[column].x, lane);
    }
    workgroupBarrier();
    for (var n = lane; n < 1024u; n += ROW_WORKGROUP) { // <= 16
        var sum = 0;
        for (var b = 0u; b < 8u; b += 1u) { // <= 8
            sum += select(0, bits[(n / 256u) * 8u + b], ((n >> b) & 1u) == 1u);
        }
        bytes[n] = sum;
    }
    workgroupBarrier();
    let i = column / params.side;
    let j = column % params.side;
    let offset = constancy_weights.d[3u * LEVELS_MAX] - params.score_min;
    for (var word = lane; word < ROW_WORDS; word += ROW_WORKGROUP) { // <= 8
        let low = cost_at(i, j, 2u * word, offset);
        // The last word has one displacement.
        var high = 0u;
        if 2u * word + 1u < DISPLACEMENTS {
            high = cost_at(i, j, 2u * word + 1u, offset);
        }
        cost.d[group.x * ROW_WORDS + word] = low | (high << 16u);
    }
}
