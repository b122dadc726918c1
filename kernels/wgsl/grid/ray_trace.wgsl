// Traces distinct rays with their weights into the window. Twin: core/src/grid/ray_trace.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Origins { d: array<vec4<i32>> }
@group(0) @binding(1) var<storage, read> origins: Origins;
struct Rays { d: array<vec2<u32>> }
@group(0) @binding(2) var<storage, read> rays: Rays;
@group(0) @binding(3) var<storage, read> slots: Rays;
struct Words { d: array<u32> }
@group(0) @binding(4) var<storage, read> distinct: Words;
@group(0) @binding(5) var<storage, read> counters: Words;
struct LogOdds { d: array<atomic<i32>> }
@group(0) @binding(6) var<storage, read_write> log_odds: LogOdds;

fn index_of(v: vec3<i32>) -> i32 {
    return (v.x * params.side + v.y) * params.levels + v.z;
}

@compute @workgroup_size(ROW_WORKGROUP)
fn ray_trace(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[DISTINCT_COUNT] {
        return;
    }
    let entry = distinct.d[id.x];
    var ray = vec2<u32>(0u);
    var weight = 1;
    if entry < MERGE_SLOTS {
        let slot = slots.d[entry];
        ray = rays.d[slot.x - 1u];
        weight = i32(slot.y);
    } else {
        ray = rays.d[entry - MERGE_SLOTS];
    }
    let end = ray_end(ray);
    var entered = false;
    var w = walk(origins.d[ray_origin(ray)].xyz, end, params.range_steps);
    for (; w.left > 0; w = advance(w)) { // <= 2000
        if inside_window(w.voxel, params.side, params.levels) {
            entered = true;
            atomicAdd(&log_odds.d[index_of(w.voxel)], LOG_ODDS_FREE * weight);
        } else if entered {
            // The window is convex: once left, it is never met again.
            break;
        }
    }
    let hit = (ray.y & NO_END) == 0u && w.length <= params.range_steps;
    if hit && inside_window(end, params.side, params.levels) {
        atomicAdd(&log_odds.d[index_of(end)], LOG_ODDS_OCCUPIED * weight);
    }
}
