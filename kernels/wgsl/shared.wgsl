// Packed records, as in core/src/record.rs. Prepended to every kernel, after the constants.
const I32_MAX: i32 = 0x7fffffff;

fn ray_end(ray: vec2<u32>) -> vec3<i32> {
    // Sign extension of 16-bit fields.
    let x = bitcast<i32>(ray.x << 16u) >> 16u;
    let y = bitcast<i32>(ray.x) >> 16u;
    let z = bitcast<i32>(ray.y << 16u) >> 16u;
    return vec3<i32>(x, y, z);
}

fn ray_origin(ray: vec2<u32>) -> u32 {
    return (ray.y >> 16u) & 0x7fffu;
}

fn pack_flow(d: vec2<i32>) -> u32 {
    return VALID | (u32(d.x + REACH) << 8u) | u32(d.y + REACH);
}

fn flow_displacement(flow: u32) -> vec2<i32> {
    return vec2<i32>(i32((flow >> 8u) & 0xffu), i32(flow & 0xffu)) - vec2<i32>(REACH);
}

// The displacement at an element of a row.
fn displacement_at(index: u32) -> vec2<i32> {
    return vec2<i32>(i32(index / LINE), i32(index % LINE)) - vec2<i32>(REACH);
}

// Bresenham's walk in three dimensions, like `Walk` in core/src/stages/grid/walk.rs.
struct Walk {
    voxel: vec3<i32>,
    left: i32,
    step_by: vec3<i32>,
    fall: i32,
    rise: vec3<i32>,
    length: i32,
    error: vec3<i32>,
}

fn walk(start: vec3<i32>, end: vec3<i32>, limit: i32) -> Walk {
    let extent = abs(end - start);
    let length = max(extent.x, max(extent.y, extent.z));
    let error = 2 * extent - length;
    let left = min(length, limit);
    return Walk(start, left, sign(end - start), 2 * length, 2 * extent, length, error);
}

fn advance(w: Walk) -> Walk {
    let due = w.error >= vec3<i32>(0);
    var next = w;
    next.voxel += select(vec3<i32>(0), w.step_by, due);
    next.error += w.rise - select(vec3<i32>(0), vec3<i32>(w.fall), due);
    next.left -= 1;
    return next;
}

fn inside_window(v: vec3<i32>, side: i32, levels: i32) -> bool {
    return all(v >= vec3<i32>(0)) && v.x < side && v.y < side && v.z < levels;
}

fn inside_square(i: i32, j: i32, side: i32) -> bool {
    return i >= 0 && i < side && j >= 0 && j < side;
}

// `a / n` rounded to the nearest integer, halves upwards; `n` is positive.
fn round_div(a: i32, n: i32) -> i32 {
    let twice = 2 * a + n;
    let quotient = twice / (2 * n);
    return quotient - select(0, 1, quotient * 2 * n > twice);
}

// The `n`-th column of the square with this reach around a column, -1 outside the window.
fn column_around(i: i32, j: i32, reach: i32, n: i32, side: i32) -> i32 {
    let line = 2 * reach + 1;
    let at = vec2<i32>(i, j) + vec2<i32>(n / line, n % line) - vec2<i32>(reach);
    return select(-1, at.x * side + at.y, inside_square(at.x, at.y, side));
}
