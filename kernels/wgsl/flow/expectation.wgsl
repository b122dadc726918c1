// The feasible displacement of least energy for every foreground column, one workgroup per column.
// Twin: core/src/stages/flow/expectation.rs; expectation_by_rings.rs next to it explains why few
// candidates are enough.

const ROW_QUADS = ROW_WORDS / 4u;
const QUADS_PER_LANE = ROW_QUADS / ROW_WORKGROUP + 1u;
// Reach of the displacements around the mean of the neighbours that are tried before any others: as
// far as there is a lane for each.
const NEAR = 3;
const NEAR_SIDE = 2 * NEAR + 1;
const_assert u32(NEAR_SIDE * NEAR_SIDE) <= ROW_WORKGROUP;

// Rows of the column and its neighbours in `pair_cost`; NONE if there is none, one less than that
// outside the window.
var<workgroup> rows: array<u32, 9>;
// Number, sum (x, y) and sum of squares of the valid flows around the column.
var<workgroup> around: array<atomic<i32>, 4>;
// Least energy of the displacements near the mean and of all, and the place of the latter.
var<workgroup> least: array<atomic<u32>, 2>;
var<workgroup> place: atomic<u32>;

struct Search {
    column: i32,
    i: i32,
    j: i32,
    own: u32,
    // Cost of the neighbours that have no row.
    beside: i32,
    n: i32,
    sum: vec2<i32>,
    squares: i32,
}

fn index_of(d: vec2<i32>) -> u32 {
    return u32(d.x + REACH) * LINE + u32(d.y + REACH);
}

// Eight costs of the window, two per word: sums of nine of at most COST_MAX never carry.
fn costs_of(quad: u32) -> vec4<u32> {
    var sum = vec4<u32>(0u);
    for (var n = 0; n < 9; n += 1) {
        if rows[n] < FOREGROUND_MAX {
            sum += pair_cost.d[rows[n] * ROW_QUADS + quad];
        }
    }
    return sum;
}

// Energy of a displacement within reach and its place in the row, NONE if it is not feasible or the
// energy is at least `energy_max`.
fn energy_at(s: Search, d: vec2<i32>, costs: vec4<u32>, energy_max: u32) -> vec2<u32> {
    let index = index_of(d);
    let cost = i32((costs[(index % 8u) / 2u] >> (16u * (index & 1u))) & 0xffffu);
    let square = d.x * d.x + d.y * d.y;
    let smoothness = s.squares + s.n * square - 2 * (d.x * s.sum.x + d.y * s.sum.y);
    // Never negative: it can be compared as unsigned, and NONE is above all energies.
    let energy = u32(cost + s.beside + sweep.displacement_cost * square
        + sweep.smoothing * smoothness);
    if energy >= energy_max || !inside_square(s.i + d.x, s.j + d.y, sweep.side) {
        return vec2<u32>(NONE);
    }
    let at = s.column + d.x * sweep.side + d.y;
    if energy < target_energy.d[at] || s.own == pack_flow(d) {
        return vec2<u32>(energy, index);
    }
    return vec2<u32>(NONE);
}

// The best of a lane's share of the column's displacements, skipping the padding.
fn everywhere(s: Search, lane: u32) -> vec2<u32> {
    var best = vec2<u32>(NONE);
    for (var quad = lane; quad < ROW_QUADS; quad += ROW_WORKGROUP) { // <= QUADS_PER_LANE
        let costs = costs_of(quad);
        for (var n = 0u; n < 8u; n += 1u) {
            let index = 8u * quad + n;
            let d = displacement_at(index);
            if d.y <= REACH {
                let found = energy_at(s, d, costs, best.x);
                best = select(best, found, found.x < best.x);
            }
        }
    }
    return best;
}

// The displacement near the mean that is assigned to a lane.
fn near_mean(s: Search, lane: i32) -> vec2<u32> {
    let mean = vec2<i32>(round_div(s.sum.x, s.n), round_div(s.sum.y, s.n));
    let d = mean + vec2<i32>(lane / NEAR_SIDE, lane % NEAR_SIDE) - vec2<i32>(NEAR);
    if lane >= NEAR_SIDE * NEAR_SIDE || max(abs(d.x), abs(d.y)) > REACH {
        return vec2<u32>(NONE);
    }
    let index = index_of(d);
    return energy_at(s, d, costs_of(index / 8u), NONE);
}

// Whether no displacement farther from the mean than the near ones can have this energy or less.
fn excludes(s: Search, floor_energy: u32, energy: u32) -> bool {
    let spread = (s.n * s.squares - s.sum.x * s.sum.x - s.sum.y * s.sum.y) / s.n;
    // Twice the least distance of the next ring from the unrounded mean.
    let near = 2 * (NEAR + 1) - 1;
    let smoothness = s.n * near * near / 4 + spread;
    return floor_energy + u32(sweep.smoothing * smoothness) > energy;
}

fn lesser(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return select(a, b, b.x < a.x || (b.x == a.x && b.y < a.y));
}

@compute @workgroup_size(ROW_WORKGROUP)
fn expectation(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let rank = group.x;
    let column = i32(foreground.d[rank]);
    let known = min_cost.d[rank];
    let i = column / sweep.side;
    let j = column % sweep.side;
    if lane < 9u {
        let neighbour = column_around(i, j, 1, i32(lane), sweep.side);
        rows[lane] = NONE - 1u;
        if neighbour >= 0 {
            rows[lane] = foreground_index.d[neighbour];
        }
    }
    if lane < 4u {
        atomicStore(&around[lane], 0);
    }
    if lane < 2u {
        atomicStore(&least[lane], NONE);
        atomicStore(&place, NONE);
    }
    workgroupBarrier();
    let neighbour = column_around(i, j, 2, i32(lane), sweep.side);
    if lane < 25u && lane != 12u && neighbour >= 0 {
        let flow = flow.d[neighbour];
        if (flow & VALID) != 0u {
            let s = flow_displacement(flow);
            atomicAdd(&around[0], 1);
            atomicAdd(&around[1], s.x);
            atomicAdd(&around[2], s.y);
            atomicAdd(&around[3], s.x * s.x + s.y * s.y);
        }
    }
    workgroupBarrier();
    var beside = 0;
    for (var n = 0; n < 9; n += 1) {
        beside += select(0, i32(COST_UNKNOWN), rows[n] == NONE);
        beside += select(0, sweep.outside_cost, rows[n] == NONE - 1u);
    }
    let n = atomicLoad(&around[0]);
    let sum = vec2<i32>(atomicLoad(&around[1]), atomicLoad(&around[2]));
    let s = Search(column, i, j, flow.d[column], beside, n, sum, atomicLoad(&around[3]));
    var mine = vec2<u32>(NONE);
    if n > 0 {
        mine = near_mean(s, i32(lane));
    } else if lane == 0u {
        // The displacement of least cost, if it is feasible.
        mine = energy_at(s, displacement_at(known.y), costs_of(known.y / 8u), NONE);
    }
    atomicMin(&least[0], mine.x);
    workgroupBarrier();
    let energy = atomicLoad(&least[0]);
    var done = energy != NONE;
    if n > 0 {
        done = excludes(s, known.x, energy);
    }
    if !done {
        mine = lesser(mine, everywhere(s, lane));
    }
    atomicMin(&least[1], mine.x);
    workgroupBarrier();
    if mine.x == atomicLoad(&least[1]) {
        atomicMin(&place, mine.y);
    }
    workgroupBarrier();
    if lane == 0u {
        let index = atomicLoad(&place);
        let found = vec2<u32>(pack_flow(displacement_at(index)), atomicLoad(&least[1]));
        proposal.d[rank] = select(found, vec2<u32>(0u, NONE), index == NONE);
    }
}
