// The columns of the previous sweep in the new window. Twin: core/src/stages/grid/shift.rs

fn moved(mask: u32) -> u32 {
    let all_levels = (1u << u32(sweep.levels)) - 1u;
    if sweep.shift_z >= 0 {
        return (mask >> u32(sweep.shift_z)) & all_levels;
    }
    return (mask << u32(-sweep.shift_z)) & all_levels;
}

@compute @workgroup_size(WORKGROUP)
fn shift(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = sweep.side;
    let column = i32(id.x);
    if column >= side * side {
        return;
    }
    let i = column / side + sweep.shift_x;
    let j = column % side + sweep.shift_y;
    var record = vec2<u32>(0u);
    if i >= 0 && i < side && j >= 0 && j < side && abs(sweep.shift_z) < sweep.levels {
        let old = columns_now.d[i * side + j];
        record = vec2<u32>(moved(old.x & 0xffffu) | (moved(old.x >> 16u) << 16u), moved(old.y));
    }
    columns_before.d[column] = record;
}
