// Packed records, as in core/src/record.rs. Put in front of every kernel, behind the constants.
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
