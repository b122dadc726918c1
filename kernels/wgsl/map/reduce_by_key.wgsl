// Sums the updates of each key of a sorted list. Twin: core/src/stages/map/reduce_by_key.rs
//
// `mark_heads` marks where a new key starts; the prefix sum of the marks numbers the keys; `fold`
// adds every update to its key's voxel. `voxels` must start as zeros.

fn is_head(index: u32) -> bool {
    if index == 0u {
        return true;
    }
    return updates.d[index].x != updates.d[index - 1u].x;
}

@compute @workgroup_size(WORKGROUP)
fn mark_heads(@builtin(global_invocation_id) id: vec3<u32>) {
    var head = 0u;
    if id.x < count_tiles.d[TILE] {
        head = select(0u, 1u, is_head(id.x));
    }
    heads.d[id.x] = head;
}

@compute @workgroup_size(WORKGROUP)
fn fold(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= count_tiles.d[TILE] {
        return;
    }
    let update = updates.d[id.x];
    let head = heads.d[id.x];
    let voxel = runs.d[id.x] + head - 1u;
    if head == 1u {
        atomicStore(&voxels.d[2u * voxel], update.x);
    }
    atomicAdd(&voxels.d[2u * voxel + 1u], update.y);
}
