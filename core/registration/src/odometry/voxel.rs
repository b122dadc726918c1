//! Cubes of space by their indices.

use glam::DVec3;

/// Index of the cube of side `side_m` that contains a place, which must not be too far from the
/// origin.
#[inline]
pub fn index_of(at: DVec3, side_m: f64) -> [i32; 3] {
    let at = at / side_m;
    // `map` on an array compiles to a call.
    [floor(at.x), floor(at.y), floor(at.z)]
}

/// Rounds down. Does without a `libm` function: this is most of the work of thinning.
#[inline]
fn floor(v: f64) -> i32 {
    let towards_zero = v as i32;
    towards_zero - i32::from(v < f64::from(towards_zero))
}

/// Spreads indices over 32 bits: multiples of large odd numbers (Teschner et al. 2003).
#[inline]
pub fn hash([x, y, z]: [i32; 3]) -> u32 {
    let mixed = (x as u32).wrapping_mul(73_856_093)
        ^ (y as u32).wrapping_mul(19_349_663)
        ^ (z as u32).wrapping_mul(83_492_791);
    mixed ^ (mixed >> 15)
}
