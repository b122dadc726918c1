// Every target keeps its best claimant. Twin: core/src/stages/flow/maximisation.rs

fn target_of(rank: u32, flow: u32) -> i32 {
    let d = flow_displacement(flow);
    return i32(foreground.d[rank]) + d.x * sweep.side + d.y;
}

@compute @workgroup_size(ROW_WORKGROUP)
fn claim(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[FOREGROUND_COUNT] {
        return;
    }
    let proposed = proposal.d[id.x];
    if proposed.x != 0u {
        atomicMin(&target_energy.d[target_of(id.x, proposed.x)], proposed.y);
    }
}

@compute @workgroup_size(ROW_WORKGROUP)
fn elect(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[FOREGROUND_COUNT] {
        return;
    }
    let proposed = proposal.d[id.x];
    if proposed.x != 0u {
        let at = target_of(id.x, proposed.x);
        if atomicLoad(&target_energy.d[at]) == proposed.y {
            atomicMin(&target_index.d[at], id.x);
        }
    }
}

@compute @workgroup_size(ROW_WORKGROUP)
fn settle(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[FOREGROUND_COUNT] {
        return;
    }
    let proposed = proposal.d[id.x].x;
    let won = proposed != 0u && atomicLoad(&target_index.d[target_of(id.x, proposed)]) == id.x;
    flow.d[foreground.d[id.x]] = select(0u, proposed, won);
}
