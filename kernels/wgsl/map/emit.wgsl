// Counts, then writes, the updates in a band by every distinct ray. Twin:
// core/src/stages/map/emit.rs

struct Merged { ray: vec2<u32>, weight: i32 }

fn merged(entry: u32) -> Merged {
    if entry < MERGE_SLOTS {
        let slot = slots.d[entry];
        return Merged(rays.d[slot.x - 1u], i32(slot.y));
    }
    return Merged(rays.d[entry - MERGE_SLOTS], 1);
}

// Key of a voxel plus 1, or 0 outside the band.
fn key_in_band(v: vec3<i32>) -> u32 {
    if !inside_window(v, sweep.side, sweep.levels) {
        return 0u;
    }
    let key = (v.x * sweep.side + v.y) * sweep.levels + v.z;
    return select(0u, u32(key) + 1u, key >= sweep.band_from && key < sweep.band_to);
}

// Keys ascend with x: a ray that misses the band's slabs has nothing in the band.
fn beside_band(start: vec3<i32>, end: vec3<i32>) -> bool {
    let slab = sweep.side * sweep.levels;
    return max(start.x, end.x) < sweep.band_from / slab
        || min(start.x, end.x) > sweep.band_to / slab;
}

@compute @workgroup_size(ROW_WORKGROUP)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    var total = 0u;
    if id.x < counters.d[DISTINCT_COUNT] {
        let m = merged(distinct.d[id.x]);
        let start = origins.d[ray_origin(m.ray)].xyz;
        let end = ray_end(m.ray);
        if !beside_band(start, end) {
            var w = walk(start, end, sweep.range_steps);
            for (; w.left > 0; w = advance(w)) { // <= RANGE_STEPS_MAX
                total += select(0u, 1u, key_in_band(w.voxel) != 0u);
            }
            let hit = (m.ray.y & NO_END) == 0u && w.length <= sweep.range_steps;
            total += select(0u, 1u, hit && key_in_band(end) != 0u);
        }
    }
    counts.d[id.x] = total;
}

@compute @workgroup_size(ROW_WORKGROUP)
fn emit(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[DISTINCT_COUNT] {
        return;
    }
    let m = merged(distinct.d[id.x]);
    let start = origins.d[ray_origin(m.ray)].xyz;
    let end = ray_end(m.ray);
    if beside_band(start, end) {
        return;
    }
    var at = offsets.d[id.x];
    var w = walk(start, end, sweep.range_steps);
    for (; w.left > 0; w = advance(w)) { // <= RANGE_STEPS_MAX
        let key = key_in_band(w.voxel);
        if key != 0u {
            updates.d[at] = vec2<u32>(key - 1u, u32(LOG_ODDS_FREE * m.weight));
            at += 1u;
        }
    }
    let hit = (m.ray.y & NO_END) == 0u && w.length <= sweep.range_steps;
    let key = key_in_band(end);
    if hit && key != 0u {
        updates.d[at] = vec2<u32>(key - 1u, u32(LOG_ODDS_OCCUPIED * m.weight));
    }
}
