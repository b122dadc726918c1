// The columns of the sweep before, seen from the new window. Twin: core/src/grid/shift.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Columns { d: array<vec2<u32>> }
@group(0) @binding(1) var<storage, read> columns_now: Columns;
@group(0) @binding(2) var<storage, read_write> columns_before: Columns;

fn moved(mask: u32) -> u32 {
    let all_levels = (1u << u32(params.levels)) - 1u;
    if params.shift_z >= 0 {
        return (mask >> u32(params.shift_z)) & all_levels;
    }
    return (mask << u32(-params.shift_z)) & all_levels;
}

@compute @workgroup_size(WORKGROUP)
fn shift(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = params.side;
    let column = i32(id.x);
    if column >= side * side {
        return;
    }
    let i = column / side + params.shift_x;
    let j = column % side + params.shift_y;
    var record = vec2<u32>(0u);
    if i >= 0 && i < side && j >= 0 && j < side && abs(params.shift_z) < params.levels {
        let old = columns_now.d[i * side + j];
        record = vec2<u32>(moved(old.x & 0xffffu) | (moved(old.x >> 16u) << 16u), moved(old.y));
    }
    columns_before.d[column] = record;
}
