// Merges equal rays in an open-addressed table. Twin: core/src/stages/grid/ray_merge.rs

fn first_slot(ray: vec2<u32>) -> u32 {
    var mixed = (ray.x * 0x9e3779b1u) ^ (ray.y * 0x85ebca77u);
    mixed = (mixed ^ (mixed >> 15u)) * 0x2c1b3c6du;
    return (mixed ^ (mixed >> 13u)) & (MERGE_SLOTS - 1u);
}

@compute @workgroup_size(WORKGROUP)
fn ray_merge(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    if index >= u32(sweep.rays) {
        return;
    }
    let ray = rays.d[index];
    var slot = first_slot(ray);
    // Finding no slot is not an error: the ray is then traced alone.
    var entry = MERGE_SLOTS + index;
    for (var probe = 0u; probe < MERGE_PROBES; probe += 1u) {
        // A load before the exchange: most rays find an equal one already there.
        var holder = atomicLoad(&slots.d[2u * slot]);
        if holder == 0u {
            holder = atomicCompareExchangeWeak(&slots.d[2u * slot], 0u, index + 1u).old_value;
            if holder == 0u {
                atomicAdd(&slots.d[2u * slot + 1u], 1u);
                entry = slot;
                break;
            }
        }
        if all(rays.d[holder - 1u] == ray) {
            atomicAdd(&slots.d[2u * slot + 1u], 1u);
            return;
        }
        slot = (slot + 1u) & (MERGE_SLOTS - 1u);
    }
    distinct.d[atomicAdd(&counters.d[DISTINCT_COUNT], 1u)] = entry;
}
