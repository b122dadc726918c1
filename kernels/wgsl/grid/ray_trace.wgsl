// Traces distinct rays with their weights into the window. Twin: core/src/stages/grid/ray_trace.rs

fn index_of(v: vec3<i32>) -> i32 {
    return (v.x * sweep.side + v.y) * sweep.levels + v.z;
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
    var w = walk(origins.d[ray_origin(ray)].xyz, end, sweep.range_steps);
    for (; w.left > 0; w = advance(w)) { // <= RANGE_STEPS_MAX
        if inside_window(w.voxel, sweep.side, sweep.levels) {
            entered = true;
            atomicAdd(&log_odds.d[index_of(w.voxel)], LOG_ODDS_FREE * weight);
        } else if entered {
            // The window is convex: once left, it is never entered again.
            break;
        }
    }
    let hit = (ray.y & NO_END) == 0u && w.length <= sweep.range_steps;
    if hit && inside_window(end, sweep.side, sweep.levels) {
        atomicAdd(&log_odds.d[index_of(end)], LOG_ODDS_OCCUPIED * weight);
    }
}
