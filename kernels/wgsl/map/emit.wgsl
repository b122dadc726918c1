// Counts, then writes, the updates of every distinct ray in a band. Twin: core/src/map/emit.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Origins { d: array<vec4<i32>> }
@group(0) @binding(1) var<storage, read> origins: Origins;
struct Pairs { d: array<vec2<u32>> }
@group(0) @binding(2) var<storage, read> rays: Pairs;
@group(0) @binding(3) var<storage, read> slots: Pairs;
struct Words { d: array<u32> }
@group(0) @binding(4) var<storage, read> distinct: Words;
@group(0) @binding(5) var<storage, read> counters: Words;
// `count` writes the counts here, `emit` reads their prefix sum.
@group(0) @binding(6) var<storage, read_write> counts: Words;
struct Updates { d: array<vec2<u32>> }
@group(0) @binding(7) var<storage, read_write> updates: Updates;

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
    if !inside_window(v, params.side, params.levels) {
        return 0u;
    }
    let key = (v.x * params.side + v.y) * params.levels + v.z;
    return select(0u, u32(key) + 1u, key >= params.band_from && key < params.band_to);
}

// Keys ascend with x: a ray beside the band's slabs has nothing in it.
fn beside_band(start: vec3<i32>, end: vec3<i32>) -> bool {
    let slab = params.side * params.levels;
    return max(start.x, end.x) < params.band_from / slab
        || min(start.x, end.x) > params.band_to / slab;
}

@compute @workgroup_size(ROW_WORKGROUP)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    var total = 0u;
    if id.x < counters.d[DISTINCT_COUNT] {
        let m = merged(distinct.d[id.x]);
        let start = origins.d[ray_origin(m.ray)].xyz;
        let end = ray_end(m.ray);
        if !beside_band(start, end) {
            var w = walk(start, end, params.range_steps);
            for (; w.left > 0; w = advance(w)) { // <= 2000
                total += select(0u, 1u, key_in_band(w.voxel) != 0u);
            }
            let hit = (m.ray.y & NO_END) == 0u && w.length <= params.range_steps;
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
    var at = counts.d[id.x];
    var w = walk(start, end, params.range_steps);
    for (; w.left > 0; w = advance(w)) { // <= 2000
        let key = key_in_band(w.voxel);
        if key != 0u {
            updates.d[at] = vec2<u32>(key - 1u, u32(LOG_ODDS_FREE * m.weight));
            at += 1u;
        }
    }
    let hit = (m.ray.y & NO_END) == 0u && w.length <= params.range_steps;
    let key = key_in_band(end);
    if hit && key != 0u {
        updates.d[at] = vec2<u32>(key - 1u, u32(LOG_ODDS_OCCUPIED * m.weight));
    }
}
