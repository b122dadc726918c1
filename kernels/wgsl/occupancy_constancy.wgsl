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

fn four(first: u32) -> vec4<i32> {
    return vec4<i32>(bits[first], bits[first + 1u], bits[first + 2u], bits[first + 3u]);
}

// Sum of the weights of the four lowest bits of `state` that are set.
fn sum_of(state: u32, weights: vec4<i32>) -> i32 {
    let chosen = (vec4<u32>(state) & vec4<u32>(1u, 2u, 4u, 8u)) != vec4<u32>(0u);
    let w = select(vec4<i32>(0), weights, chosen);
    return (w.x + w.y) + (w.z + w.w);
}

// Mask of the target at element `at` of the row; the padding is unknown, as a target outside the
// window is.
fn target_at(i: i32, j: i32, at: u32) -> u32 {
    let ti = i + i32(at / LINE) - REACH;
    let tj = j + i32(at % LINE) - REACH;
    if at % LINE < SIDE && ti >= 0 && ti < params.side && tj >= 0 && tj < params.side {
        return columns_now.d[ti * params.side + tj].x;
    }
    return 0u;
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
    let w0 = four(0u);
    let w1 = four(4u);
    let w2 = four(8u);
    let w3 = four(12u);
    let w4 = four(16u);
    let w5 = four(20u);
    let w6 = four(24u);
    let w7 = four(28u);
    let i = column / params.side;
    let j = column % params.side;
    let offset = constancy_weights.d[3u * LEVELS_MAX] - params.score_min;
    for (var word = lane; word < ROW_WORDS; word += ROW_WORKGROUP) { // <= 8
        var packed = 0u;
        for (var half = 0u; half < 2u; half += 1u) { // <= 2
            let state = target_at(i, j, 2u * word + half);
            let score = sum_of(state, w0) + sum_of(state >> 4u, w1)
                + sum_of(state >> 8u, w2) + sum_of(state >> 12u, w3)
                + sum_of(state >> 16u, w4) + sum_of(state >> 20u, w5)
                + sum_of(state >> 24u, w6) + sum_of(state >> 28u, w7);
            packed |= constancy_costs.d[score + offset] << (16u * half);
        }
        cost.d[group.x * ROW_WORDS + word] = packed;
    }
}
