// Costs of a foreground column at every displacement, one workgroup per column.
// Twin: core/src/stages/occupancy_constancy.rs

var<workgroup> bits: array<i32, 32>;

// What a mask bit of a target contributes to the score of the source.
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

// Sums of the weights of four bits for two targets at once, whose masks are the halves of `masks`,
// shifted so that the bits are lowest: the sum of the low half plus 65536 times that of the high.
fn sums_of(masks: u32, weights: vec4<i32>) -> i32 {
    let chosen = (vec4<u32>(masks) >> vec4<u32>(0u, 1u, 2u, 3u)) & vec4<u32>(0x10001u);
    let w = vec4<i32>(chosen) * weights;
    return (w.x + w.y) + (w.z + w.w);
}

// Mask of the target at element `at` of the row; the padding is unknown, like a target outside the
// window.
fn target_at(i: i32, j: i32, at: u32) -> u32 {
    let ti = i + i32(at / LINE) - REACH;
    let tj = j + i32(at % LINE) - REACH;
    if at % LINE < SIDE && ti >= 0 && ti < sweep.side && tj >= 0 && tj < sweep.side {
        return columns_now.d[ti * sweep.side + tj].x;
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
    let i = column / sweep.side;
    let j = column % sweep.side;
    let offset = constancy_weights.d[3u * LEVELS_MAX] - sweep.score_min;
    for (var word = lane; word < ROW_WORDS; word += ROW_WORKGROUP) { // <= ROW_WORDS / ROW_WORKGROUP + 1
        let low = target_at(i, j, 2u * word);
        let high = target_at(i, j, 2u * word + 1u);
        let free = (low & 0xffffu) | (high << 16u);
        let occupied = (low >> 16u) | (high & 0xffff0000u);
        let both = sums_of(free, w0) + sums_of(free >> 4u, w1)
            + sums_of(free >> 8u, w2) + sums_of(free >> 12u, w3)
            + sums_of(occupied, w4) + sums_of(occupied >> 4u, w5)
            + sums_of(occupied >> 8u, w6) + sums_of(occupied >> 12u, w7);
        // Scores fit in 16 bits with their sign: the low one is taken out before the high one.
        let first = (both << 16u) >> 16u;
        let second = (both - first) >> 16u;
        pair_cost.d[group.x * ROW_WORDS + word] = constancy_costs.d[first + offset]
            | (constancy_costs.d[second + offset] << 16u);
    }
}
