// Log-odds to column masks. Twin: core/src/stages/grid/columns.rs

@compute @workgroup_size(WORKGROUP)
fn columns(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = i32(id.x);
    if column >= sweep.side * sweep.side {
        return;
    }
    var free = 0u;
    var occupied = 0u;
    var solid = 0u;
    for (var k = 0; k < sweep.levels; k += 1) { // <= LEVELS_MAX
        let l = log_odds.d[column * sweep.levels + k];
        free |= select(0u, 1u, l < 0) << u32(k);
        occupied |= select(0u, 1u, l > 0) << u32(k);
        solid |= select(0u, 1u, l >= LOG_ODDS_SOLID) << u32(k);
    }
    columns_now.d[column] = vec2<u32>(free | (occupied << 16u), solid);
}
