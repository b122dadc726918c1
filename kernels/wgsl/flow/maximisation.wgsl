// Every target keeps its best claimant. Twin: core/src/flow/maximisation.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Words { d: array<u32> }
@group(0) @binding(1) var<storage, read> counters: Words;
@group(0) @binding(2) var<storage, read> foreground: Words;
struct Proposals { d: array<vec2<u32>> }
@group(0) @binding(3) var<storage, read> proposal: Proposals;
struct Atomics { d: array<atomic<u32>> }
@group(0) @binding(4) var<storage, read_write> target_energy: Atomics;
@group(0) @binding(5) var<storage, read_write> target_rank: Atomics;
@group(0) @binding(6) var<storage, read_write> state: Words;

fn target_of(rank: u32, flow: u32) -> i32 {
    let d = flow_displacement(flow);
    return i32(foreground.d[rank]) + d.x * params.side + d.y;
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
fn rank(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[FOREGROUND_COUNT] {
        return;
    }
    let proposed = proposal.d[id.x];
    if proposed.x != 0u {
        let at = target_of(id.x, proposed.x);
        if atomicLoad(&target_energy.d[at]) == proposed.y {
            atomicMin(&target_rank.d[at], id.x);
        }
    }
}

@compute @workgroup_size(ROW_WORKGROUP)
fn settle(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= counters.d[FOREGROUND_COUNT] {
        return;
    }
    let flow = proposal.d[id.x].x;
    let won = flow != 0u && atomicLoad(&target_rank.d[target_of(id.x, flow)]) == id.x;
    state.d[foreground.d[id.x]] = select(0u, flow, won);
}
