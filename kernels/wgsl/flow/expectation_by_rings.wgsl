// The feasible displacement of least energy for every foreground column, one invocation per column:
// for devices that are CPUs. Twin: core/src/stages/flow/expectation_by_rings.rs, which explains the
// search.

struct Best { energy: i32, index: i32 }

// Rows of the column and its neighbours in `pair_cost`, NONE if there is none.
var<private> rows: array<u32, 9>;
// Cost of those without one: the unknown cost inside the window, one given by the profile outside.
var<private> beside: i32;

fn look_around(i: i32, j: i32) {
    beside = 0;
    for (var n = 0; n < 9; n += 1) {
        let ni = i + n / 3 - 1;
        let nj = j + n % 3 - 1;
        var row = NONE;
        if inside_square(ni, nj, sweep.side) {
            row = foreground_index.d[ni * sweep.side + nj];
            beside += select(0, i32(COST_UNKNOWN), row == NONE);
        } else {
            beside += sweep.outside_cost;
        }
        rows[n] = row;
    }
}

// Eight costs of the window, two per word.
fn costs_of(quad: u32) -> vec4<u32> {
    var sum = vec4<u32>(0u);
    for (var n = 0; n < 9; n += 1) {
        if rows[n] < FOREGROUND_MAX {
            sum += pair_cost.d[rows[n] * (ROW_WORDS / 4u) + quad];
        }
    }
    return sum;
}

fn cost_in(costs: vec4<u32>, n: u32) -> i32 {
    return i32((costs[n / 2u] >> (16u * (n & 1u))) & 0xffffu) + beside;
}

fn consider(best: Best, column: i32, index: i32, energy: i32, own: u32) -> Best {
    if energy > best.energy || (energy == best.energy && index > best.index) {
        return best;
    }
    let d = displacement_at(u32(index));
    let at = column + d.x * sweep.side + d.y;
    if u32(energy) < target_energy.d[at] || own == pack_flow(d) {
        return Best(energy, index);
    }
    return best;
}

// Every displacement, without smoothing.
fn everywhere(column: i32, i: i32, j: i32, own: u32) -> Best {
    var best = Best(I32_MAX, I32_MAX);
    for (var quad = 0u; quad < ROW_WORDS / 4u; quad += 1u) {
        let costs = costs_of(quad);
        for (var n = 0u; n < 8u; n += 1u) {
            let index = i32(8u * quad + n);
            let d = displacement_at(u32(index));
            if d.y <= REACH && inside_square(i + d.x, j + d.y, sweep.side) {
                let square = d.x * d.x + d.y * d.y;
                let energy = cost_in(costs, n) + sweep.displacement_cost * square;
                if energy < best.energy {
                    best = consider(best, column, index, energy, own);
                }
            }
        }
    }
    return best;
}

// Rings of growing distance around the mean of `n` neighbours with sum `s` and sum of squares
// `squares`.
fn rings(
    rank: u32,
    column: i32,
    i: i32,
    j: i32,
    own: u32,
    n: i32,
    s: vec2<i32>,
    squares: i32,
) -> Best {
    var best = Best(I32_MAX, I32_MAX);
    let floor_energy = i32(min_cost.d[rank].x);
    let mean = vec2<i32>(round_div(s.x, n), round_div(s.y, n));
    let spread = (n * squares - s.x * s.x - s.y * s.y) / n;
    for (var ring = 0; ring <= 2 * REACH; ring += 1) {
        let near = max(2 * ring - 1, 0);
        if floor_energy + sweep.smoothing * (n * near * near / 4 + spread) > best.energy {
            break;
        }
        // The ring's cells in order: 8 per unit of its radius, 1 for ring 0.
        let cells = max(8 * ring, 1);
        for (var cell = 0; cell < cells; cell += 1) { // <= 8 * 2 * REACH
            let d = mean + on_ring(ring, cell);
            if inside_square(i + d.x, j + d.y, sweep.side) && max(abs(d.x), abs(d.y)) <= REACH {
                let square = d.x * d.x + d.y * d.y;
                let smoothness = squares + n * square - 2 * (d.x * s.x + d.y * s.y);
                let index = (d.x + REACH) * i32(LINE) + d.y + REACH;
                let cost = cost_in(costs_of(u32(index) / 8u), u32(index) % 8u);
                let energy = cost
                    + sweep.displacement_cost * square + sweep.smoothing * smoothness;
                best = consider(best, column, index, energy, own);
            }
        }
    }
    return best;
}

// Cell `n` of a ring: two full lines, then the sides.
fn on_ring(ring: i32, n: i32) -> vec2<i32> {
    let line = 2 * ring + 1;
    if n < line {
        return vec2<i32>(-ring, n - ring);
    }
    if n < 2 * line {
        return vec2<i32>(ring, n - line - ring);
    }
    let side = n - 2 * line;
    return vec2<i32>(side / 2 - ring + 1, select(-ring, ring, (side & 1) == 1));
}

@compute @workgroup_size(ROW_WORKGROUP)
fn expectation_by_rings(@builtin(global_invocation_id) id: vec3<u32>) {
    let rank = id.x;
    if rank >= counters.d[FOREGROUND_COUNT] {
        return;
    }
    let column = i32(foreground.d[rank]);
    let i = column / sweep.side;
    let j = column % sweep.side;
    var count = 0;
    var sum = vec2<i32>(0);
    var squares = 0;
    for (var n = 0; n < 25; n += 1) {
        let ni = i + n / 5 - 2;
        let nj = j + n % 5 - 2;
        if n != 12 && inside_square(ni, nj, sweep.side) {
            let flow = flow.d[ni * sweep.side + nj];
            if (flow & VALID) != 0u {
                let s = flow_displacement(flow);
                count += 1;
                sum += s;
                squares += s.x * s.x + s.y * s.y;
            }
        }
    }
    let own = flow.d[column];
    look_around(i, j);
    var best = Best(I32_MAX, I32_MAX);
    if count == 0 {
        // The displacement of least cost, if it is feasible.
        let known = min_cost.d[rank];
        best = consider(best, column, i32(known.y), i32(known.x), own);
        if best.index == I32_MAX {
            best = everywhere(column, i, j, own);
        }
    } else {
        best = rings(rank, column, i, j, own, count, sum, squares);
    }
    if best.index == I32_MAX {
        proposal.d[rank] = vec2<u32>(0u, NONE);
    } else {
        proposal.d[rank] = vec2<u32>(pack_flow(displacement_at(u32(best.index))), u32(best.energy));
    }
}
