// Log-odds to column masks. Twin: core/src/grid/columns.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct LogOdds { d: array<i32> }
@group(0) @binding(1) var<storage, read> log_odds: LogOdds;
struct Columns { d: array<vec2<u32>> }
@group(0) @binding(2) var<storage, read_write> columns_now: Columns;

@compute @workgroup_size(WORKGROUP)
fn columns(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = i32(id.x);
    if column >= params.side * params.side {
        return;
    }
    var free = 0u;
    var occupied = 0u;
    var solid = 0u;
    for (var k = 0; k < params.levels; k += 1) { // <= LEVELS_MAX
        let l = log_odds.d[column * params.levels + k];
        free |= select(0u, 1u, l < 0) << u32(k);
        occupied |= select(0u, 1u, l > 0) << u32(k);
        solid |= select(0u, 1u, l >= LOG_ODDS_SOLID) << u32(k);
    }
    columns_now.d[column] = vec2<u32>(free | (occupied << 16u), solid);
}
